# Runs an image as its file says, in a network of its own that container_image.sh made:  container_image_inside.sh FILE TILES PODMAN...
# TILES: what the program made of the sample outside. The folder is one that looks like the repository.
set -euo pipefail
file=$1 tiles=$2
podman=("${@:3}")
sample=deploy/sample/white_mountains_srtm3.tif tile=10/617/763.drc
url=http://127.0.0.1:8080
fail() { printf 'container_image: %s\n' "$*" >&2; "${podman[@]}" logs service 2>/dev/null >&2 || true; exit 1; }
umount /sys/fs/cgroup/unified 2>/dev/null || true  # crun refuses a system with both kinds of groups
ip link set lo up

# docker run ...: in this network, so that no port needs to be handed on; without a GPU, which nobody here has; and in the background
# if it serves. No systemd is here to look at its health from time to time.
docker() {
  local word words=()
  shift
  for word in "$@"; do
    case $word in
      -p | 127.0.0.1:8080:8080 | --gpus | all) ;;
      -v) words+=(--detach --name service "$word") ;;
      *) words+=("$word") ;;
    esac
  done
  "${podman[@]}" run --network host --health-interval disable --ulimit "nofile=$(ulimit -Hn):$(ulimit -Hn)" --ulimit nproc=4096:4096 "${words[@]}"
}
lines() { sed -n 's/^#   \(docker run\)/\1/p' "$1"; }

rm -f tokens
image=$(lines "$file" | tail -n 1 | sed 's/.* //')
! docker run --rm "$image" >refused 2>&1 && grep -q 'there are no tokens' refused || fail "it serves everybody without a token: $(cat refused)"
eval "$(lines deploy/Dockerfile | head -n 1)" 2>shown || fail "no token: $(cat shown)"
token=$(sed -n 's/^token: *//p' shown)
[[ -n $token && $(wc -l <tokens) = 1 ]] || fail "no token, or no line of it: $(cat shown tokens)"
eval "$(lines "$file" | tail -n 1)" >/dev/null || fail "it does not start"

# What the image says of its health, and nothing else, tells when it is ready.
healthy() { "${podman[@]}" healthcheck run service >/dev/null 2>&1; }
for ((looks = 0; looks < 100; ++looks)); do
  if healthy; then break; fi
  sleep 0.2
done
healthy || fail "it never is healthy"
[[ $("${podman[@]}" exec service id -un) = cordillera ]] || fail "it runs as $("${podman[@]}" exec service id -un)"

[[ $(curl -s -o refused -w '%{http_code}' -T $sample -X POST "$url/v1/datasets?name=sample.tif") = 401 ]] || fail "a post without a token: $(cat refused)"
curl -fsS -H "Authorization: Bearer $token" -H 'Prefer: wait=300' -T $sample -X POST "$url/v1/datasets?name=sample.tif" -o posted || fail "the sample was not taken"
id=$(python3 -c 'import json; print(json.load(open("posted"))["id"])')
same_tile() { curl -fsS -o tile "$url/v1/datasets/$id/tiles/$tile" && cmp tile "$tiles/tiles/$tile" || fail "$1"; }
same_tile "its tile is not the one made outside"
curl -fsS "$url/" | grep '<title>Cordillera' >/dev/null || fail "no page"
"${podman[@]}" logs service 2>&1 | grep 'jobs are confined by' >/dev/null || fail "jobs are not confined"

# The volume outlives the container; the service ends when it is asked to.
"${podman[@]}" stop --time 20 service >/dev/null
"${podman[@]}" logs service 2>&1 | grep '"stopped"' >/dev/null || fail "it did not end by itself"
"${podman[@]}" rm service >/dev/null
eval "$(lines "$file" | tail -n 1)" >/dev/null
for ((looks = 0; looks < 100; ++looks)); do
  if healthy; then break; fi
  sleep 0.2
done
same_tile "a new container on the same volume has another tile"
"${podman[@]}" rm --force --time 20 --volumes service >/dev/null
"${podman[@]}" volume rm cordillera >/dev/null
