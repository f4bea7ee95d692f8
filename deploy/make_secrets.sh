#!/bin/bash
# Makes the certificates, tokens and passwords of deploy/compose.yaml and compose.postgres.yaml, in
# deploy/secrets. What is there stays.
#
#   deploy/make_secrets.sh [HOST...]    names and IP addresses under which robots and browsers reach
#                                       this machine, besides localhost; for others later, remove
#                                       secrets/server.pem before
#
# Needs openssl, and the command hypermap of the package hypermap-client ($HYPERMAP). The folder is
# closed to other users of the machine; the containers, which run as users of their own, get single
# files of it.
set -euo pipefail
folder=${SECRETS:-$(dirname "$0")/secrets}
hypermap=$(realpath "$(command -v "${HYPERMAP:-hypermap}")") || {
  echo "make_secrets.sh: the command hypermap is missing" >&2
  exit 1
}

names=DNS:localhost,IP:127.0.0.1,DNS:server,DNS:server-b,DNS:database
for host in "$@"; do
  if [[ $host =~ ^[0-9.]+$ || $host == *:* ]]; then names+=,IP:$host; else names+=,DNS:$host; fi
done

umask 077
mkdir -p "$folder/access"
cd "$folder"

# make_certificate NAME OPTIONS: makes NAME.pem and NAME.key.
make_certificate() {
  local name=$1 said
  shift
  [[ -e $name.pem ]] && return
  said=$(openssl req -x509 -newkey ec -pkeyopt ec_paramgen_curve:prime256v1 -noenc "$@" \
    -keyout "$name.key" -out "$name.pem" 2>&1) || { echo "$said" >&2; exit 1; }
}
make_certificate ca -days 3650 -subj '/CN=Maps of this site'
make_certificate server -days 365 -subj /CN=hypermap -CA ca.pem -CAkey ca.key \
  -addext "subjectAltName=$names" -addext basicConstraints=critical,CA:FALSE
[[ -e session.key ]] || head -c 32 /dev/urandom > session.key
[[ -e database.password ]] || openssl rand -hex 24 > database.password
[[ -e store.yaml ]] || cat > store.yaml << END
store: postgresql://hypermap:$(cat database.password)@database/maps?sslmode=verify-full&sslrootcert=/run/secrets/ca
END

# make_token IDENTITY OPTIONS
make_token() {
  [[ -e $1.token ]] && return
  "$hypermap" token create "$@" --file access/access.yaml > new.token
  mv new.token "$1.token"
}
make_token ops --role admin
# Makes its layer, and sends observations in the names of all robots that it gets frames from.
make_token ingest --role editor --map site --robot '*'

chmod 0755 access
chmod 0644 access/access.yaml ca.pem server.pem server.key session.key ingest.token \
  database.password store.yaml
echo "certificates, tokens and passwords are in $PWD; ops.token is yours, and ca.key belongs on another machine"
