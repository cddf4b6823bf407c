#include "server/client/sender.h"

#include "proto/numbers.h"
#include "server/http/digest.h"

namespace cordillera::server::client {
namespace {

using proto::Problem;
using Clock = std::chrono::steady_clock;

constexpr std::chrono::seconds kOfHashing{1800};  // a service reads all of an upload before it answers
constexpr std::chrono::milliseconds kBetweenLooks{100};

bool taken(const Answer& answer) {
  return answer.trouble.empty() && (answer.status == 200 || answer.status == 201 || answer.status == 202);
}

std::string to_base64(const std::string& text) {
  static constexpr char kDigits[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string out;
  for (std::size_t at = 0; at < text.size(); at += 3) {
    std::uint32_t bits = 0;
    for (std::size_t k = 0; k < 3; ++k) bits = bits << 8 | (at + k < text.size() ? static_cast<unsigned char>(text[at + k]) : 0u);
    for (std::size_t k = 0; k < 4; ++k) out += at + k <= text.size() ? kDigits[bits >> (18 - 6 * k) & 63] : '=';
  }
  return out;
}

/// "uploads/abc", whatever stands before it: the id of an upload.
std::string id_in(const std::string& location) { return location.substr(location.rfind('/') + 1); }

std::string path_of(const UploadNote& note) { return "/v1/uploads/" + note.upload(); }

}  // namespace

void Sender::forget() {
  for (const auto& note : notes_) note->remove();
  notes_.clear();
}

void Sender::show(std::uint64_t done, std::uint64_t total) {
  const auto now = Clock::now();
  if (done < total && now - shown_ < kBetweenLooks) return;
  shown_ = now;
  proto::Progress progress;
  progress.set_stage("upload");
  progress.set_done(static_cast<double>(done));
  progress.set_total(static_cast<double>(total));
  const double seconds = std::chrono::duration<double>(now - started_).count();
  const bool known = done > first_ && seconds > 1;
  progress.set_seconds_left(known ? seconds * static_cast<double>(total - done) / static_cast<double>(done - first_) : -1);
  bar_.show(progress);
}

Call Sender::with_bytes(LocalFile& file, std::uint64_t from, std::uint64_t count) {
  Call call;
  call.length = count;
  call.body = [this, &file, from](std::uint64_t at, std::size_t most) {
    show(from + at, file.size());
    return file.read(from + at, most);
  };
  return call;
}

proto::Result<Json> Sender::send(LocalFile& file, const PostTarget& target, Way way) {
  started_ = shown_ = Clock::now();
  first_ = 0;
  auto sent = way == Way::whole ? send_whole(file, target) : send_parts(file, target);
  bar_.finish();
  return file.problem() ? proto::Result<Json>(*file.problem()) : sent;
}

proto::Result<Json> Sender::send_whole(LocalFile& file, const PostTarget& target) {
  Call call = with_bytes(file, 0, file.size());
  call.method = "POST";
  call.path = target.path + "?" + target.query;
  // The answer may get lost: asked again, the service gives the same dataset.
  call.headers = {{"Idempotency-Key", "cordillera-" + random_letters(26)}};
  call.patience = kOfHashing;
  talk_.moved();
  while (true) {
    const Answer answer = talk_.once(call);
    if (taken(answer)) return object_in(answer);
    bar_.finish();
    if (file.problem() || !talk_.may_help(answer)) return talk_.problem_of(answer);
  }
}

proto::Result<Json> Sender::send_parts(LocalFile& file, const PostTarget& target) {
  // Whatever the options are: who corrects one goes on with the same bytes.
  auto opened = UploadNote::open(talk_.address() + "\n" + target.path + "\n" + file.path(), file.identity());
  if (!opened) return opened.problem();
  UploadNote& note = *notes_.emplace_back(std::move(*opened));
  if (!note.outdated().empty()) talk_.once({"DELETE", "/v1/uploads/" + note.outdated()});
  talk_.moved();
  if (!note.upload().empty()) {
    const Answer stands = talk_.patiently({"HEAD", path_of(note)});
    const auto offset = proto::number<std::uint64_t>(stands.header("upload-offset"));
    if (stands.whole(200) && offset && proto::number<std::uint64_t>(stands.header("upload-length")) == file.size()) {
      first_ = *offset;
    } else if (stands.status == 0) {
      return talk_.problem_of(stands);
    } else {
      // A dataset was made of it, and only the answer is missing; or the service has forgotten it.
      const Answer made = finish(target, note.upload());
      if (taken(made)) return object_in(made);
      note.keep("");
    }
  }
  if (note.upload().empty()) {
    if (const auto begun = begin(file, target, note); !begun) return begun.problem();
  }
  if (const auto sent = send_rest(file, note, first_); !sent) return sent.problem();
  const Answer answer = finish(target, note.upload());
  return taken(answer) ? proto::Result<Json>(object_in(answer)) : talk_.problem_of(answer);
}

proto::Result<void> Sender::begin(const LocalFile& file, const PostTarget& target, UploadNote& note) {
  Call call = {"POST", "/v1/uploads"};
  call.headers = {{"Tus-Resumable", "1.0.0"},
                  {"Upload-Length", std::to_string(file.size())},
                  {"Upload-Metadata", "filename " + to_base64(target.name)}};
  const Answer begun = talk_.patiently(call);
  if (!begun.whole(201)) return talk_.problem_of(begun);
  note.keep(id_in(begun.header("location")));
  talk_.moved();
  return {};
}

proto::Result<void> Sender::send_rest(LocalFile& file, const UploadNote& note, std::uint64_t offset) {
  while (offset < file.size()) {
    Call call = with_bytes(file, offset, std::min(kPart, file.size() - offset));
    call.method = "PATCH";
    call.path = path_of(note);
    call.type = "application/offset+octet-stream";
    call.headers = {{"Tus-Resumable", "1.0.0"}, {"Upload-Offset", std::to_string(offset)}};
    Answer answer = talk_.once(call);
    if (!answer.whole(204)) {
      bar_.finish();
      if (file.problem() || !talk_.may_help(answer)) return talk_.problem_of(answer);
      answer = talk_.patiently({"HEAD", path_of(note)});  // what came before the connection broke is kept
      if (!answer.whole(200)) return talk_.problem_of(answer);
    }
    const auto stands = proto::number<std::uint64_t>(answer.header("upload-offset"));
    if (!stands || *stands > file.size())
      return Problem{"answer-unknown", talk_.address() + " does not say how much of the upload it has",
                     "a service that speaks tus 1.0", ""};
    if (*stands > offset) talk_.moved();
    offset = *stands;
  }
  show(offset, file.size());
  return {};
}

Answer Sender::finish(const PostTarget& target, const std::string& upload) {
  Call call = {"POST", target.path + "?" + target.query + "&upload=" + upload};
  call.patience = kOfHashing;
  return talk_.patiently(call);
}

}  // namespace cordillera::server::client
