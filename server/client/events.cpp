#include "server/client/events.h"

#include <cmath>

#include "server/http/percent.h"

namespace cordillera::server::client {
namespace {

proto::Progress progress_in(const Json& json) {
  proto::Progress progress;
  const auto number = [&json](const char* name, double missing) {
    const auto found = json.find(name);
    return found != json.end() && found->is_number() ? found->get<double>() : missing;
  };
  const double place = number("place", 0), share = number("share", 0);
  const std::string stage = text_in(json, "stage");
  progress.set_stage((stage.empty() ? "queued" : stage) + (place > 0 ? ", place " + std::to_string(std::lround(place)) : ""));
  // The share of all stages: one bar that never goes back.
  progress.set_done(100 * share);
  progress.set_total(place > 0 || number("total", 0) == 0 ? 0 : 100);
  progress.set_seconds_left(number("seconds_left", -1));
  return progress;
}

/// How a dataset ended, if it has.
struct End {
  std::optional<Json> ready;
  std::optional<proto::Problem> failed;
  explicit operator bool() const { return ready || failed; }
};

bool is_lazy(const Json& status) { return status.is_object() && text_in(status, "build") == "lazy"; }

/// The status of a dataset as an end. A lazy build has come as far as it does by itself once there are tiles. A failed change of
/// its rasters leaves it ready, as it was before.
End end_in(const Json& status) {
  const std::string state = text_in(status, "state");
  const Json error = status.value("error", Json()), updates = status.value("updates", Json());
  if (is_lazy(status) && status.value("provisional", Json()) == true) return {status, {}};
  if (state == "failed") return {{}, problem_in(error.is_object() ? error : Json::object())};
  if (state != "ready" || (updates.is_object() && updates.value("pending", Json(0)) != 0)) return {};
  const Json last = updates.is_object() ? updates.value("last", Json()) : Json();
  if (last.is_object() && last.contains("error") && last["error"].is_object()) return {{}, problem_in(last["error"])};
  return {status, {}};
}

/// What an event says; nothing of use if it is no object.
End end_in(const std::string& event, const Json& json, ProgressBar& bar) {
  if (!json.is_object()) return {};
  if (event == "ready") return end_in(json);
  if (event == "failed") return {{}, problem_in(json)};
  if (event == "progress") bar.show(progress_in(json));
  return {};
}

}  // namespace

bool EventReader::feed(std::string_view piece, const std::function<bool(const Event&)>& take) {
  for (const char c : piece) {
    if (c != '\n') {
      rest_ += c;
      continue;
    }
    if (rest_.ends_with('\r')) rest_.pop_back();
    const bool ends = rest_.empty();
    if (!ends) line(rest_);
    rest_.clear();
    if (!ends) continue;
    Event whole = std::move(event_);
    event_ = {};
    if (!std::exchange(has_data_, false)) continue;
    if (whole.name.empty()) whole.name = "message";
    if (!take(whole)) return false;
  }
  return true;
}

void EventReader::line(std::string_view text) {
  const auto colon = text.find(':');
  const std::string_view field = text.substr(0, colon);
  std::string_view value = colon == text.npos ? std::string_view() : text.substr(colon + 1);
  if (value.starts_with(' ')) value.remove_prefix(1);
  if (field == "event") event_.name = value;
  if (field != "data") return;  // a line that begins with a colon is a comment
  if (has_data_) event_.data += '\n';
  event_.data += value;
  has_data_ = true;
}

std::string how_it_stands(const Json& status) {
  const bool ready = text_in(status, "state") == "ready";
  return text_in(status, "id") + (ready ? " is ready" : " can be seen; its blocks are made as their tiles are asked for");
}

proto::Result<Json> follow(Talk& talk, const std::string& id, ProgressBar& bar) {
  const std::string path = "/v1/datasets/" + percent_encoded(id);
  talk.moved();
  while (true) {
    // A stream begins with how the dataset stands, so one that broke is simply asked for again.
    EventReader reader;
    End end;
    bool tiles = false, lazy = false;  // there are some; their blocks are made as they are asked for
    Call call = {"GET", path + "/events"};
    call.take = [&](std::string_view piece) {
      talk.moved();
      return reader.feed(piece, [&](const Event& event) {
        const Json json = Json::parse(event.data, nullptr, false);
        tiles = tiles || event.name == "tiles";
        lazy = tiles && event.name == "progress" && is_lazy(json);
        return !(end = end_in(event.name, json, bar)) && !lazy;
      });
    };
    Answer answer = talk.once(call);
    if (!end && (lazy || (answer.status != 200 && answer.status != 0))) {
      const Answer status = talk.once({"GET", path});  // else too many streams, or a proxy without them
      if (status.whole(200)) {
        const Json json = object_in(status);
        end = end_in(json);
        if (json.value("progress", Json()).is_object()) bar.show(progress_in(json["progress"]));
        if (answer.status == 429 || answer.status == 503) talk.moved();
      } else if (status.status != 0) {
        answer = status;
      }
    }
    if (end) bar.finish();
    if (end.failed) return *end.failed;
    if (end.ready) return *end.ready;
    if (answer.whole(200)) answer.trouble = "the stream of events ended before the build";
    if (!talk.may_help(answer)) {
      bar.finish();
      return talk.problem_of(answer);
    }
  }
}

}  // namespace cordillera::server::client
