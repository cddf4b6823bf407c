# Runs within the system that clean_machine.sh made, which has a shell, coreutils and tar: clean_machine_inside.sh PORT
set -euo pipefail
port=$1
sample=white_mountains_srtm3.tif
cd /root
export DEBIAN_FRONTEND=noninteractive CORDILLERA_SERVER=http://127.0.0.1:$port
server=
trap '[[ -z $server ]] || kill "$server" 2>/dev/null || true' EXIT
now_ms() { date +%s%3N; }
got() { exec 3<>"/dev/tcp/127.0.0.1/$port"; printf 'GET %s HTTP/1.1\r\nHost: 127.0.0.1\r\nConnection: close\r\n\r\n' "$1" >&3; cat <&3; exec 3>&-; }

# serve_and_show PROGRAM SAMPLE NAME: posts the sample, fetches a tile of it and the page that shows it.
serve_and_show() {
  "$1" serve --data "$3" --listen "127.0.0.1:$port" 2>"$3.log" &
  server=$!
  until grep -q listening "$3.log"; do kill -0 $server || { cat "$3.log"; exit 1; }; sleep 0.02; done
  "$1" post "$2" --wait --json -q >"$3.json"
  id=$(grep -o '"id": *"[^"]*"' "$3.json" | head -n 1 | cut -d'"' -f4)
  got "/?dataset=$id" | tr -d '\r' >"$3.page"
  grep -q '^HTTP/1.1 200' "$3.page" && grep -q '<title>Cordillera' "$3.page" || { cat "$3.page"; exit 1; }
  if ! grep -q 'viewer is not installed' "$3.page"; then
    got /cesium/Cesium.js >"$3.script"
    grep -qa '^HTTP/1.1 200' "$3.script" || { echo "no CesiumJS"; exit 1; }
  fi
  "$1" fetch "$id" 10/617/763.drc -o "$3.drc" -q
  shown_ms=$(now_ms)
  "$1" decode "$3.drc" >/dev/null
  kill $server
  wait $server || true
  server=
}

if [[ -e cordillera.deb ]]; then
  apt-get update -qq
  apt-get install -y -qq --no-install-recommends ./cordillera.deb >apt.log 2>&1 || { cat apt.log; exit 1; }
  cordillera doctor --data deb >doctor || { cat doctor; exit 1; }
  serve_and_show cordillera "/usr/share/cordillera/web/sample/$sample" deb
  apt-get remove -y -qq cordillera >/dev/null
  [[ ! -e /usr/bin/cordillera && -e deb/registry.sqlite ]]
  echo "the .deb: installed, served, removed"
fi

from_ms=$(now_ms)
tar -xzf cordillera.tar.gz
program=$(echo /root/cordillera-*/bin/cordillera)
serve_and_show "$program" "$(echo /root/cordillera-*/share/cordillera/sample/$sample)" archive
if [[ -e deb.drc ]]; then cmp deb.drc archive.drc; fi
. /etc/os-release
printf 'the archive on %s, %s: %s s from unpacking until / showed the sample\n' "$PRETTY_NAME" "$(ldd --version | sed -n '1s/.* //p')" \
  "$(awk -v ms=$((shown_ms - from_ms)) 'BEGIN { printf "%.1f", ms / 1000 }')"
