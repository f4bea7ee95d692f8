#!/bin/bash
# Makes the certificates and tokens of deploy/compose.yaml, in deploy/secrets. What is there stays.
#
#   deploy/make_secrets.sh [HOST...]    names and IP addresses under which robots and browsers reach
#                                       this machine, besides localhost
#
# Needs openssl, and the command hypermap of the package hypermap-client ($HYPERMAP). The folder is
# closed to other users of the machine; the containers, which run as users of their own, get single
# files of it.
set -euo pipefail
folder=${SECRETS:-$(dirname "$0")/secrets}
hypermap=${HYPERMAP:-hypermap}

names=DNS:localhost,IP:127.0.0.1,DNS:server
for host in "$@"; do
  if [[ $host =~ ^[0-9.]+$ || $host == *:* ]]; then names+=,IP:$host; else names+=,DNS:$host; fi
done

umask 077
mkdir -p "$folder/access"
cd "$folder"
key=(-newkey ec -pkeyopt ec_paramgen_curve:prime256v1 -noenc)
if [[ ! -e ca.pem ]]; then
  openssl req -x509 "${key[@]}" -days 3650 -subj '/CN=Maps of this site' -keyout ca.key \
    -out ca.pem 2>/dev/null
fi
if [[ ! -e server.pem ]]; then
  openssl req -x509 "${key[@]}" -days 365 -subj /CN=hypermap -CA ca.pem -CAkey ca.key \
    -addext "subjectAltName=$names" -addext basicConstraints=critical,CA:FALSE \
    -keyout server.key -out server.pem 2>/dev/null
fi
[[ -e session.key ]] || head -c 32 /dev/urandom > session.key

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
chmod 0644 access/access.yaml ca.pem server.pem server.key session.key ingest.token
echo "certificates and tokens are in $PWD; ops.token is yours, and ca.key belongs on another machine"
