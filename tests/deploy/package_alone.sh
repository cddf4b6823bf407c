# The archive alone with glibc, in a root of its own: sourced by package.sh.
if [[ $(id -u) != 0 ]]; then
  echo "package: not tried alone with glibc: only root can make a root"
  exit 0
fi
alone=$work/alone
install -D /lib64/ld-linux-x86-64.so.2 "$alone/lib64/ld-linux-x86-64.so.2"
for name in libc.so.6 libm.so.6 libgcc_s.so.1 libresolv.so.2; do
  install -D "$(ldconfig -p | sed -n "s#^\s*$name (.*x86-64.*) => ##p" | sed -n 1p)" "$alone/lib/x86_64-linux-gnu/$name"
done
mkdir -p "$alone"/{proc,dev,tmp,etc/pki/tls/certs}
touch "$alone"/dev/{null,urandom}
mv "$unpacked" "$alone/anywhere"
cp "$work/a.asc" "$alone/tmp"
in_root=(unshare --mount bash -c 'mount -t proc proc "$1/proc" && for file in null urandom; do mount --bind /dev/$file "$1/dev/$file"; done &&
  exec chroot "$@"' _ "$alone" /anywhere/bin/cordillera)

"${in_root[@]}" build /tmp/a.asc -o /tmp/tiles "${words[@]}" || fail "the archive does not run alone with glibc"
diff -r "$work/tiles/tiles" "$alone/tmp/tiles/tiles" || fail "alone it builds other tiles"

# A service: its page, what the page draws with, and the sample that the page offers.
port=$(free_port)
url=http://127.0.0.1:$port
start "${in_root[@]}" serve --listen "127.0.0.1:$port" --data /tmp/data --device cpu >"$work/alone.log" 2>&1
served=$started
until_ready "$served" "$work/alone.log"
curl -fsS "$url/" | grep '<title>Cordillera' >/dev/null || fail "/ is no page of Cordillera"
if [[ -e $build/share/web/complete ]]; then
  curl -fsS -o "$work/Cesium.js" "$url/cesium/Cesium.js" || fail "the page has no CesiumJS"
  curl -fsS -o "$work/sample.tif" "$url/sample/white_mountains_srtm3.tif" || fail "the page has no sample"
fi
sample=$repository/deploy/sample/white_mountains_srtm3.tif
[[ ! -e $work/sample.tif ]] || cmp "$sample" "$work/sample.tif" || fail "the sample of the page is another"
dataset=$(curl -fsS -T "$sample" -X POST -H 'Prefer: wait=300' "$url/v1/datasets?name=sample.tif&error=20" | json_id) || fail "$(<"$work/alone.log")"
curl -fsS -o "$work/tile.drc" "$url/v1/datasets/$dataset/tiles/10/617/763.drc"
"$work/usr/bin/cordillera" build "$sample" -o "$work/same" --error 20 --device cpu -q
cmp "$work/same/tiles/10/617/763.drc" "$work/tile.drc" || fail "alone it serves another tile"
stop "$served" || fail "the service did not end well: $(<"$work/alone.log")"

# Who speaks https is trusted as the machine trusts, here one that keeps its certificates where Fedora does.
command -v openssl >/dev/null || { echo "package: https is not tried: no openssl here"; exit 0; }
openssl req -x509 -newkey ec -pkeyopt ec_paramgen_curve:P-256 -nodes -days 2 -subj /CN=127.0.0.1 -addext subjectAltName=IP:127.0.0.1 \
  -keyout "$work/key.pem" -out "$work/trusted.pem" 2>/dev/null
port=$(free_port)
start python3 "$here/https_404.py" "$port" "$work/trusted.pem" "$work/key.pem"
until (exec 3<>"/dev/tcp/127.0.0.1/$port") 2>/dev/null; do kill -0 "$started" || fail "no server that speaks https"; sleep 0.05; done
asked() { env -u SSL_CERT_FILE -u SSL_CERT_DIR "${in_root[@]}" watch 00000000 --server "https://127.0.0.1:$port" 2>&1 || true; }
[[ $(asked) == *'certificate is not to be trusted'* ]] || fail "a certificate that nobody vouches for is taken: $(asked)"
cp "$work/trusted.pem" "$alone/etc/pki/tls/certs/ca-bundle.crt"
[[ $(asked) == *404* ]] || fail "the machine's certificates are not found: $(asked)"
