#!/usr/bin/env bash
# Succeeds while the agent answers /healthz with 200, which is about its work; prints the answer for `docker inspect`. Plain
# bash: the image has no HTTP client. An agent with TLS answers this one question on loopback without it, too.
set -euo pipefail
port="${SEMASCAN_PORT:-8787}"
exec 3<>"/dev/tcp/127.0.0.1/$port"
printf 'GET /healthz HTTP/1.1\r\nHost: 127.0.0.1:%s\r\nConnection: close\r\n\r\n' "$port" >&3
read -r -t 2 status <&3
# The answer is a few hundred bytes; the connection ends after it.
timeout 2 cat <&3 | tail -n 1
[[ "$status" == "HTTP/1.1 200"* ]]
