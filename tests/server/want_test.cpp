// A machine that has no thread more, or no memory. Each test is a process of its own: what it is denied, it never gets back.
#include <gtest/gtest.h>
#include <openssl/crypto.h>
#include <sys/resource.h>
#include <unistd.h>

#include <cstdlib>
#include <fstream>
#include <future>
#include <memory>
#include <new>
#include <string>
#include <system_error>
#include <thread>
#include <vector>

#include "pipeline/encode/json.h"
#include "pipeline/store/content_hash.h"
#include "server/front/workers.h"
#include "server/http/digest.h"
#include "server/memory/heap.h"
#include "tests/sanitized.h"

namespace cordillera::server {
namespace {

/// So few addresses from now on that a thread finds none for its stack, and small things still do.
void allow_no_thread_more() {
  std::ifstream statm("/proc/self/statm");
  rlim_t pages = 0;
  statm >> pages;
  const rlim_t bytes = pages * static_cast<rlim_t>(sysconf(_SC_PAGESIZE)) + (rlim_t{2} << 20);
  const rlimit limit{bytes, bytes};
  setrlimit(RLIMIT_AS, &limit);
}

/// 0: a request was answered though the system has no thread more.
int answer_without_another_thread() {
  front::Workers workers(4, 10, 10);
  allow_no_thread_more();
  try {
    std::thread([] {}).join();
    return 2;  // it has: nothing is shown
  } catch (const std::system_error&) {}
  std::promise<void> answered;
  if (workers.run("client", [&] { answered.set_value(); }) != front::Workers::Taken::yes) return 1;
  answered.get_future().get();
  return 0;
}

constexpr int kNever = 1 << 30;
int before_denial = kNever;  ///< so many are given yet
int denied = 0;

bool is_denied() {
  if (before_denial-- > 0) return false;
  ++denied;
  return true;
}
void* openssl_malloc(std::size_t size, const char*, int) { return is_denied() ? nullptr : std::malloc(size); }
void* openssl_realloc(void* old, std::size_t size, const char*, int) { return is_denied() ? nullptr : std::realloc(old, size); }
void openssl_free(void* block, const char*, int) { std::free(block); }

/// bad_alloc, or the right answer, whichever piece of memory is denied first.
template <class Make>
bool right_or_told(const Make& make) {
  for (int given = 0; given < 20; ++given) {
    before_denial = kNever;
    const std::string right = make("abc");
    (void)make("another");  // what is left lying about is not the right answer
    before_denial = given;
    try {
      if (make("abc") != right) return false;
    } catch (const std::bad_alloc&) {}
  }
  return true;
}

/// 0: no digest is wrong, and nothing ends, though OpenSSL finds no memory.
int digests_without_memory() {
  if (CRYPTO_set_mem_functions(openssl_malloc, openssl_realloc, openssl_free) != 1) return 3;
  if (!right_or_told(digest) || !right_or_told(pipeline::content_hash)) return 1;
  return denied >= 4 ? 0 : 2;
}

/// 0: who finds no memory has some on the way out, and again after the next.
int reserve_on_the_way_out() {
  set_up_heap();
  allow_no_thread_more();
  for (int turn = 0; turn < 2; ++turn) {
    std::vector<std::unique_ptr<char[]>> all;  // small blocks, until none is left
    try {
      while (true) all.push_back(std::make_unique<char[]>(1000));
    } catch (const std::bad_alloc&) {
      // As a destructor would.
      for (int k = 0; k < 100; ++k) all.push_back(std::make_unique<char[]>(1000));
    }
    all.clear();
    keep_reserve();
  }
  return 0;
}

/// 0: documents go where not a byte is left, not even the reserve; and what they held is free again.
int documents_go_without_memory() {
  using pipeline::Json;
  set_up_heap();
  Json flat = Json::array(), deep = Json::array();
  Json tree = Json::parse(R"({"a":[1,[2,{"b":{"c":[[],{},"a text that is not kept in place",null]}}]],"d":[[[[]]]],"e":{}})");
  for (int k = 0; k < 1000; ++k) flat.push_back({{"number", k}});
  for (int k = 0; k < 200000; ++k) {
    Json around = Json::array({k});
    around.push_back(std::move(deep));
    if (k % 3 == 0) around = Json{{"member", std::move(around)}};
    deep = std::move(around);
  }
  allow_no_thread_more();
  for (const std::size_t size : {std::size_t{1} << 16, std::size_t{1000}, std::size_t{16}}) {
    for (int refused = 0; refused < 2; ++refused) {  // the first time the reserve becomes free
      try {
        while (true) (void)operator new(size);
      } catch (const std::bad_alloc&) {}
    }
  }
  int unbegun = 0;
  for (int given = 0; given < 12; ++given) {  // one that is built goes too, wherever it stops
    Json begun;
    try {
      for (int k = 0; k < given; ++k) begun.push_back(k);
      begun = nullptr;
      begun["member"]["of it"].push_back({{"a text that is not kept in place", given}});
    } catch (const std::bad_alloc&) { ++unbegun; }
  }
  if (unbegun == 0) return 2;
  tree = nullptr;
  flat = nullptr;
  deep = nullptr;
  return operator new(1000) != nullptr ? 0 : 1;
}

TEST(Want, ADocumentNeedsNoMemoryToGo) {
  if (kSanitized) GTEST_SKIP() << "a sanitizer's heap is another";
  GTEST_FLAG_SET(death_test_style, "threadsafe");
  EXPECT_EXIT(_exit(documents_go_without_memory()), testing::ExitedWithCode(0), "");
}

TEST(Want, NoDigestIsWrongForWantOfMemory) {
  if (kSanitized) GTEST_SKIP() << "a sanitizer's heap is another";
  GTEST_FLAG_SET(death_test_style, "threadsafe");
  EXPECT_EXIT(_exit(digests_without_memory()), testing::ExitedWithCode(0), "");
}

TEST(Want, WhoFindsNoMemoryHasSomeOnTheWayOut) {
  if (kSanitized) GTEST_SKIP() << "a sanitizer's heap is another";
  GTEST_FLAG_SET(death_test_style, "threadsafe");
  EXPECT_EXIT(_exit(reserve_on_the_way_out()), testing::ExitedWithCode(0), "");
}

TEST(Want, WhoListensHasAThreadToAnswer) {
  if (kSanitized) GTEST_SKIP() << "a sanitizer's addresses cannot be counted";
  GTEST_FLAG_SET(death_test_style, "threadsafe");
  EXPECT_EXIT(_exit(answer_without_another_thread()), testing::ExitedWithCode(0), "");
}

}  // namespace
}  // namespace cordillera::server
