#pragma once
// A host that rasters are fetched from, in this process: it does what a test says, and keeps what it was asked for, byte for
// byte.
#include <httplib.h>
#include <openssl/pem.h>
#include <openssl/x509v3.h>

#include <algorithm>
#include <atomic>
#include <cstdio>
#include <filesystem>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

namespace cordillera::server {

/// A key, and a certificate that it signed itself, in a file. name: "DNS:localhost".
class OwnCertificate {
 public:
  OwnCertificate(const std::filesystem::path& folder, const std::string& name) : file_((folder / "certificate.pem").string()) {
    X509_set_version(certificate_.get(), 2);
    ASN1_INTEGER_set(X509_get_serialNumber(certificate_.get()), 1);
    X509_gmtime_adj(X509_getm_notBefore(certificate_.get()), -3600);
    X509_gmtime_adj(X509_getm_notAfter(certificate_.get()), 24 * 3600);
    X509_set_pubkey(certificate_.get(), key_.get());
    X509_NAME* const subject = X509_get_subject_name(certificate_.get());
    X509_NAME_add_entry_by_txt(subject, "O", MBSTRING_ASC, reinterpret_cast<const unsigned char*>("a test"), -1, -1, 0);
    X509_set_issuer_name(certificate_.get(), subject);
    X509_EXTENSION* const names = X509V3_EXT_conf_nid(nullptr, nullptr, NID_subject_alt_name, name.c_str());
    X509_add_ext(certificate_.get(), names, -1);
    X509_EXTENSION_free(names);
    X509_sign(certificate_.get(), key_.get(), EVP_sha256());
    std::FILE* const out = std::fopen(file_.c_str(), "w");
    PEM_write_X509(out, certificate_.get());
    std::fclose(out);
  }
  X509* certificate() const { return certificate_.get(); }
  EVP_PKEY* key() const { return key_.get(); }
  const std::string& file() const { return file_; }

 private:
  const std::string file_;
  const std::unique_ptr<EVP_PKEY, decltype(&EVP_PKEY_free)> key_{EVP_EC_gen("P-256"), &EVP_PKEY_free};
  const std::unique_ptr<X509, decltype(&X509_free)> certificate_{X509_new(), &X509_free};
};

/// Certificates that OpenSSL trusts, while it lives.
class TrustedFile {
 public:
  explicit TrustedFile(const std::string& file) {
    if (const char* before = getenv(kName)) before_ = before;
    setenv(kName, file.c_str(), 1);
  }
  ~TrustedFile() { before_ ? setenv(kName, before_->c_str(), 1) : unsetenv(kName); }
  TrustedFile(const TrustedFile&) = delete;
  TrustedFile& operator=(const TrustedFile&) = delete;

 private:
  static constexpr const char* kName = "SSL_CERT_FILE";
  std::optional<std::string> before_;
};

class RasterHost {
 public:
  RasterHost() : RasterHost(std::make_unique<httplib::Server>(), "http://127.0.0.1:") {}
  explicit RasterHost(const OwnCertificate& own)
      : RasterHost(std::make_unique<httplib::SSLServer>(own.certificate(), own.key()), "https://localhost:") {}
  ~RasterHost() {
    ending_ = true;
    server_->stop();
    serving_.join();
  }
  RasterHost(const RasterHost&) = delete;
  RasterHost& operator=(const RasterHost&) = delete;

  /// Without a slash at its end.
  const std::string& address() const { return address_; }
  void leads(const std::string& target, const std::string& location) { put(target, {302, location, Ends::well}); }
  void has(const std::string& target, const std::string& bytes) { put(target, {200, bytes, Ends::well}); }
  /// The same with a tag; who names it is told that nothing has changed.
  void has_tagged(const std::string& target, const std::string& bytes, const std::string& tag) {
    put(target, {200, bytes, Ends::well, tag});
  }
  /// How a host sends parts. All but three begin well. held: those that the host holds back wait.
  enum class Parts {
    none,
    well,
    elsewhere,
    cut,
    not_after_the_first,
    endless,
    hanging,
    held,
    other_size,
    without_total,
    untagged,
    in_full
  };
  /// The same, and parts of it to who asks for one.
  void has_parts(const std::string& target, const std::string& bytes, const std::string& tag, Parts parts = Parts::well) {
    put(target, {200, bytes, Ends::well, tag, parts});
  }
  void hold_back() { holds_back_ = true; }
  void let_go() { holds_back_ = false; }
  void has_no_more(const std::string& target) {
    const std::lock_guard lock(mutex_);
    said_.erase(target);
  }
  /// Says that there are more bytes than it sends.
  void breaks_off(const std::string& target, const std::string& bytes) { put(target, {200, bytes, Ends::early}); }
  /// Says that there are bytes, and sends none; or one after the other, without an end.
  void hangs(const std::string& target) { put(target, {200, "", Ends::never}); }
  void drips(const std::string& target) { put(target, {200, "x", Ends::never}); }
  /// Bytes of bodies that it was asked for, in parts or not.
  std::uint64_t sent() const {
    const std::lock_guard lock(mutex_);
    return sent_;
  }
  /// Targets of all requests, as they came.
  std::vector<std::string> asked() const {
    const std::lock_guard lock(mutex_);
    return asked_;
  }

 private:
  enum class Ends { well, early, never };
  struct Said {
    int status;
    std::string text;
    Ends ends;
    std::string tag = {};
    Parts parts = Parts::none;
  };

  RasterHost(std::unique_ptr<httplib::Server> server, const std::string& origin) : server_(std::move(server)) {
    server_->set_pre_routing_handler([this](const httplib::Request& request, httplib::Response& answer) {
      const_cast<httplib::Request&>(request).ranges.clear();  // else the library cuts what is answered
      say(take(request.target), request, answer);
      return httplib::Server::HandlerResponse::Handled;
    });
    address_ = origin + std::to_string(server_->bind_to_any_port("127.0.0.1"));
    serving_ = std::thread([this] { server_->listen_after_bind(); });
    while (!server_->is_running()) std::this_thread::yield();  // one that does not run yet cannot be stopped
  }

  void put(const std::string& target, const Said& said) {
    const std::lock_guard lock(mutex_);
    said_[target] = said;
  }
  Said take(const std::string& target) {
    const std::lock_guard lock(mutex_);
    asked_.push_back(target);
    const auto found = said_.find(target);
    return found == said_.end() ? Said{404, "", Ends::well} : found->second;
  }
  void say(const Said& said, const httplib::Request& request, httplib::Response& answer) {
    answer.status = said.status;
    if (!said.tag.empty() && said.parts != Parts::untagged) answer.set_header("ETag", said.tag);
    if (!said.tag.empty() && request.get_header_value("If-None-Match") == said.tag) {
      answer.status = 304;
      return;
    }
    if (said.status == 302) answer.set_header("Location", said.text);
    if (said.status != 200) return;
    const std::string tag = request.get_header_value("If-Range");
    std::size_t first = 0, last = 0;
    const bool asked = std::sscanf(request.get_header_value("Range").c_str(), "bytes=%zu-%zu", &first, &last) == 2;
    if (asked && said.parts != Parts::none && first < said.text.size() && (tag.empty() || tag == said.tag))
      return say_part(said, {first, std::min(last + 1, said.text.size())}, answer);
    count(said.text.size());
    if (said.ends == Ends::well) return answer.set_content(said.text, "image/tiff");
    if (said.ends == Ends::never) return go_on(said.text, answer);
    answer.set_content_provider(2 * said.text.size(), "image/tiff",
                                [text = said.text](std::size_t from, std::size_t, httplib::DataSink& sink) {
                                  return from == 0 && sink.write(text.data(), text.size());
                                });
  }

  void go_on(const std::string& text, httplib::Response& answer) {
    answer.set_content_provider(std::size_t{1} << 40, "image/tiff",
                                [this, text](std::size_t, std::size_t, httplib::DataSink& sink) {
                                  while (text.empty() && !ending_ && sink.is_writable())
                                    std::this_thread::sleep_for(std::chrono::milliseconds(20));
                                  return !ending_ && !text.empty() && sink.write(text.data(), text.size());
                                });
  }

  struct Part {
    std::size_t first, end;
  };
  void say_part(const Said& said, const Part& part, httplib::Response& answer) {
    const bool well = part.first == 0;
    const std::size_t moved = said.parts == Parts::elsewhere && !well ? 1 : 0;
    const std::string total = said.parts == Parts::without_total
                                  ? "*"
                                  : std::to_string(said.text.size() + (said.parts == Parts::other_size && !well ? 1 : 0));
    std::string text = said.text.substr(part.first, part.end - part.first);
    if (said.parts == Parts::not_after_the_first && !well)
      text = said.text;
    else if (said.parts == Parts::in_full)
      answer.status = 200;  // so it says, and sends a part
    else
      answer.status = 206;
    if (answer.status == 206 || said.parts == Parts::in_full)
      answer.set_header("Content-Range",
                        "bytes " + std::to_string(part.first + moved) + "-" + std::to_string(part.end - 1 + moved) + "/" + total);
    while (said.parts == Parts::held && !well && holds_back_ && !ending_)
      std::this_thread::sleep_for(std::chrono::milliseconds(20));
    count(text.size());
    if (said.parts == Parts::cut && !well) {
      answer.set_content_provider(text.size(), "image/tiff", [text](std::size_t from, std::size_t, httplib::DataSink& sink) {
        return from == 0 && sink.write(text.data(), text.size() / 2);
      });
    } else if (said.parts == Parts::endless && !well) {
      answer.set_chunked_content_provider(
          "image/tiff", [text](std::size_t, httplib::DataSink& sink) { return sink.write(text.data(), text.size()); });
    } else if (said.parts == Parts::hanging && !well) {
      answer.set_content_provider(text.size(), "image/tiff", [this](std::size_t, std::size_t, httplib::DataSink& sink) {
        while (!ending_ && sink.is_writable()) std::this_thread::sleep_for(std::chrono::milliseconds(20));
        return false;
      });
    } else {
      answer.set_content(text, "image/tiff");
    }
  }
  void count(std::size_t bytes) {
    const std::lock_guard lock(mutex_);
    sent_ += bytes;
  }

  const std::unique_ptr<httplib::Server> server_;
  std::string address_;
  std::thread serving_;
  mutable std::mutex mutex_;
  std::map<std::string, Said> said_;
  std::vector<std::string> asked_;
  std::uint64_t sent_ = 0;
  std::atomic<bool> ending_{false}, holds_back_{false};
};

}  // namespace cordillera::server
