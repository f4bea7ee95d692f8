#!/bin/bash
# Checks what deploy/ contains with the tools of its formats: hadolint for the Dockerfile, the schemas
# of the oldest and the newest Kubernetes in use for what kustomize makes of the manifests, compose-go
# for the files of compose, promtool for the alert rules and the configurations of Prometheus. The
# tools are installed in build/lint-deploy: Python packages, Go modules, and promtool, which is unpacked
# from Debian's package, because installing that starts a service. The exit code is 77 if one can't be
# had here.
set -euo pipefail
cd "$(dirname "$0")/.."
tools=$PWD/build/lint-deploy
KUSTOMIZE=v5.7.1
COMPOSE=v2.4.5
KUBERNETES=(1.29 1.37)

skip() {
  echo "skipped: $*" >&2
  exit 77
}

if ! cmp --silent tools/lint_deploy.txt "$tools/installed.txt"; then
  python3 -m venv "$tools" || skip "no python3-venv here"
  "$tools/bin/pip" install --quiet --disable-pip-version-check --require-hashes \
    --requirement tools/lint_deploy.txt || skip "no package index"
  cp tools/lint_deploy.txt "$tools/installed.txt"
fi
if [[ ! -x $tools/usr/bin/promtool ]]; then
  (cd "$tools" && apt-get -qq download prometheus 2>/dev/null && dpkg-deb --extract prometheus_*.deb .) ||
    skip "no Debian packages here"
fi
[[ -x $tools/bin/kustomize ]] ||
  GOBIN=$tools/bin go install "sigs.k8s.io/kustomize/kustomize/v5@$KUSTOMIZE" || skip "no kustomize"
if [[ ! -x $tools/bin/compose ]]; then
  GOBIN=$tools/go go install "github.com/compose-spec/compose-go/v2/cmd@$COMPOSE" || skip "no compose-go"
  mv "$tools/go/cmd" "$tools/bin/compose"
fi

"$tools/bin/hadolint" deploy/Dockerfile
echo "hadolint: deploy/Dockerfile"
for folder in base overlays/single-node overlays/postgres; do
  "$tools/bin/kustomize" build "deploy/kubernetes/$folder" >"$tools/manifests.yaml"
  for version in "${KUBERNETES[@]}"; do
    "$tools/bin/kubernetes-validate" --strict --quiet --kubernetes-version "$version" "$tools/manifests.yaml"
    echo "Kubernetes $version: deploy/kubernetes/$folder"
  done
done
for files in compose.yaml 'compose.yaml compose.postgres.yaml'; do
  # shellcheck disable=SC2086 # The string is a list of words.
  (cd deploy && "$tools/bin/compose" $files >/dev/null)
  echo "compose: $files"
done
"$tools/usr/bin/promtool" check rules deploy/prometheus/hypermap.rules.yml
"$tools/usr/bin/promtool" check config deploy/prometheus/prometheus.yml deploy/prometheus/prometheus.postgres.yml
