/* What glibc has had since 2.36 and Debian 12's libraries call (older_versions.py). */
#include <stdint.h>
#include <stdlib.h>
#include <sys/random.h>

void arc4random_buf(void* to, size_t size) {
  for (char* at = to; size > 0;) {
    const ssize_t got = getrandom(at, size, 0);
    if (got < 0) continue; /* a signal came */
    at += got, size -= (size_t)got;
  }
}

uint32_t arc4random(void) {
  uint32_t number;
  arc4random_buf(&number, sizeof number);
  return number;
}
