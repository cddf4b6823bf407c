// The queue's part for datasets whose rasters are fetched from an address, and fetched again when something else stands there.

#include "pipeline/build/build.h"
#include "pipeline/store/mesh_files.h"
#include "raster/disk/write_all.h"
#include "raster/storage/storage.h"
#include "server/datasets/dataset_folder.h"
#include "server/datasets/upload.h"
#include "server/http/json.h"
#include "server/jobs/job_queue.h"
#include "server/log/log.h"

namespace cordillera::server {
namespace {

namespace fs = std::filesystem;

// Beside the first; what was built stays meanwhile. Of a source that cannot be reached: a quarter of an hour.
constexpr int kTriesOfSource = 2, kTriesToReach = 8;
constexpr auto kBeforeAnew = std::chrono::milliseconds(200);
constexpr const char* kStays = "stays";  // of what is served, although something else stands at its address
constexpr const char* kNext = "next-";   // before the name of a raster that is not whole, or whose time has not come

proto::Problem cannot(const std::string& what) { return {"storage-full", what, "trying again when there is room", ""}; }
proto::Problem stays(const proto::Problem& why) { return {kStays, why.detail, why.accepted, ""}; }

}  // namespace

std::optional<updates::Print> fetched_print(const fs::path& folder) {
  constexpr std::size_t kLongestNote = 16 << 10;
  const auto note = updates::read_note(folder / kFetchedFile, kLongestNote);
  return note ? updates::print_in(Json::parse(*note, nullptr, false)) : std::nullopt;
}

void JobQueue::tell_fetching(const std::string& id) {
  proto::Progress progress;
  progress.set_stage("fetch");
  progress.set_total(1);
  progress.set_seconds_left(-1);
  hub_.publish(id, progress);
}

void JobQueue::fetch_anew(const std::string& id) {
  const Row dataset = registry_.find(id);
  if (!dataset) return;
  {
    const std::lock_guard lock(mutex_);
    anew_.insert(id);
  }
  enqueue({id, owner_of(*dataset), 0});
}

bool JobQueue::while_idle(const std::string& id, const std::function<void()>& work) {
  const auto flag = begin(id, Work::apart);
  if (!flag) ask_to_end(id);
  if (!flag || turns_.place(id)) return false;
  work();
  looked_at_.forget(id);
  return true;
}

fs::path JobQueue::next_rasters(const std::string& id) const { return layout_.dataset(id) / (std::string(kNext) + kRasters); }

/// Or its beginning and what came of it since; of a list those that it names.
bool JobQueue::has_raster(const Dataset& dataset) const {
  std::error_code error;
  const fs::path folder = layout_.dataset(dataset.id);
  const auto is_there = [&](const fs::path& file, bool ranged) {
    return fs::exists(file, error) && fs::exists(map_of(file), error) == ranged;
  };
  const auto print = fetched_print(folder);
  if (!is_there(folder / dataset.raster, print && print->ranged)) return false;
  if (!print || !print->list) return true;
  const auto listed = updates::read_listed(folder);
  for (int k = 0; listed && k < listed->rasters_size(); ++k)
    if (!is_there(folder / kRasters / updates::file_of(*listed, k), listed->rasters(k).ranged())) return false;
  return listed.has_value();
}

/// What becomes of a build whose raster could not be read to its end because of where it comes from: another attempt, after a
/// while or with what stands there now. nullopt: no more, or it failed of something else.
std::optional<JobQueue::Next> JobQueue::fetch_again(const Dataset& dataset, const proto::Problem& why, const Turn& turn) {
  const bool changed = why.type == "source-replaced";
  if (dataset.address.empty() || !(changed || why.type == "source-unreachable")) return std::nullopt;
  Turn again = turn;
  int& tries = changed ? again.replaced : again.unreached;
  if (++tries > (changed ? kTriesOfSource : kTriesToReach)) return std::nullopt;
  if (changed) {
    const std::lock_guard lock(mutex_);
    anew_.insert(dataset.id);
    // Servers behind one name that do not agree on a tag, or on parts, have the file all the same.
    if (tries == kTriesOfSource) as_whole_.insert(dataset.id);
  }
  registry_.set_state(dataset.id, State::queued, why);
  hub_.touch(dataset.id);
  log_warning("dataset " + dataset.id + ": " + why.line() + "; tried again");
  later(changed ? std::chrono::milliseconds(kBeforeAnew) : wait_before(again.unreached), again);
  return Next::done;
}

/// What a dataset's raster needs before its build: nothing; or the turn ends here.
std::optional<JobQueue::Next> JobQueue::have_raster(const Dataset& dataset, const Turn& turn, const std::atomic<bool>& stop) {
  const std::string& id = dataset.id;
  if (dataset.address.empty() || dataset.state == State::failed) return std::nullopt;
  bool anew = false;
  {
    const std::lock_guard lock(mutex_);
    anew = anew_.erase(id) > 0;
  }
  if (!anew && (dataset.state == State::ready || has_raster(dataset))) return std::nullopt;
  if (dataset.state == State::queued) registry_.set_state(id, State::running, std::nullopt);
  const auto fetched = fetch_raster(dataset, stop);
  if (gave_way(id))
    log_info("dataset " + id + ": its source is slow, and others wait: what stands there now is looked at when it is read again");
  if (stop) return Next::done;
  if (fetched) {  // who noticed meanwhile that something else stands there has what stands there
    const std::lock_guard lock(mutex_);
    anew_.erase(id);
    return std::nullopt;
  }
  if (fetched.problem().type == kStays) {
    log_warning("dataset " + id +
                ": what stands at its address now cannot be built, and what was built stays: " + fetched.problem().detail);
    hub_.touch(id);
    return Next::done;
  }
  if (!is_passing(fetched.problem(), turn.attempt)) return finish(dataset, fetched.problem()), Next::done;
  if (anew) {
    const std::lock_guard lock(mutex_);
    anew_.insert(id);
  } else {
    registry_.set_state(id, State::queued, fetched.problem());
  }
  hub_.touch(id);
  log_warning("dataset " + id + ": " + fetched.problem().line() + "; tried again later");
  retry_later(turn);
  return Next::done;
}

/// What has an address and waits for its build is fetched meanwhile, for a first look. True: it is there. What goes wrong is met
/// again by its build, and told then.
bool JobQueue::fetch_ahead(const std::string& id) {
  const auto flag = begin(id, Work::fetch);
  const Row dataset = flag ? registry_.find(id) : nullptr;
  if (!dataset || dataset->state != State::queued) return false;
  if (has_raster(*dataset)) return true;
  const LogScope job("job", id), request("request", dataset->request_id);
  const auto fetched = fetch_raster(*dataset, *flag);
  if (!fetched && !*flag) log_info("dataset " + id + ": not fetched ahead of its build: " + fetched.problem().line());
  return fetched.ok();
}

/// What came and is not taken.
void JobQueue::drop_next(const Dataset& dataset) const {
  const fs::path file = layout_.dataset(dataset.id) / (kNext + dataset.raster);
  std::error_code ignored;
  for (const fs::path& next : {file, map_of(file), next_rasters(dataset.id)}) fs::remove_all(next, ignored);
}

/// What stands at the address of a dataset now, beside what it had. Of what is served, kStays where that cannot be built.
proto::Result<JobQueue::Fetched> JobQueue::fetch_next(const Dataset& dataset, bool as_whole, const std::atomic<bool>& stop) {
  const bool served = dataset.state == State::ready;
  drop_next(dataset);  // of a fetch that was ended
  Fetched next{layout_.dataset(dataset.id) / (kNext + dataset.raster), next_rasters(dataset.id), {}, std::nullopt};
  const auto print = (as_whole ? fetch_.whole : fetch_.beginning)(dataset.address, next.file, stop);
  if (!print && served && print.problem().type == "body-too-large") return stays(print.problem());
  if (!print) return print.problem();
  next.print = *print;
  if (next.print.ranged) return next;
  auto taken = take_list(dataset, next.file, stop);
  if (!taken && served && !stop && !is_passing(taken.problem(), 0)) return stays(taken.problem());
  if (!taken) return taken.problem();
  next.listed = std::move(*taken);
  next.print.list = next.listed.has_value();
  return next;
}

/// Why what stands at the address of a dataset now is no raster that could be built, or are none.
std::optional<proto::Problem> JobQueue::look_at_next(const Dataset& dataset, const Fetched& next, const std::atomic<bool>& stop) {
  const fs::path folder = layout_.dataset(dataset.id);
  proto::Job job = job_of(dataset);
  job.set_raster(next.file.filename().string());
  job.set_dry_run(true);
  job.set_provisional(false);
  const auto rasters = sources_of(dataset, next, job);
  limit(job, folder);
  if (!write_job(folder, job)) return std::nullopt;  // its build will say so
  ProgressSink nobody = [](const proto::Progress&) {};
  nobody.rasters = rasters.get();
  const auto outcome = runner_(folder, nobody, stop);
  std::error_code ignored;
  fs::remove(folder / kJobFile, ignored);
  // More than a look may read of it has come meanwhile: its build goes on in several turns, which no look does.
  const bool is_slow = !outcome && rasters && outcome.problem().type == "build-time-limit";
  return outcome || is_slow ? std::nullopt : std::optional(outcome.problem());
}

/// What was made of the raster before is served until this one has come, and has been looked at.
proto::Result<void> JobQueue::fetch_raster(const Dataset& dataset, const std::atomic<bool>& stop) {
  const fs::path folder = layout_.dataset(dataset.id);
  std::error_code error;
  fs::create_directories(folder, error);
  if (error) return cannot("the folder of " + dataset.id + " cannot be made: " + error.message());
  if (const auto written = write_record(folder, dataset); !written) return written;
  log_info("dataset " + dataset.id + ": its raster is fetched");
  tell_fetching(dataset.id);
  bool as_whole = !is_lazy(dataset);
  {
    const std::lock_guard lock(mutex_);
    as_whole = as_whole_.contains(dataset.id) || as_whole;
  }
  for (int tries = 0;; ++tries) {
    // As in fetch_again().
    const auto next = fetch_next(dataset, as_whole || tries == kTriesOfSource, stop);
    if (!next) return drop_next(dataset), next.problem();
    {
      const std::lock_guard lock(mutex_);
      as_whole_.erase(dataset.id);
    }
    const auto refused = dataset.state == State::ready ? look_at_next(dataset, *next, stop) : std::nullopt;
    if (!stop && !refused) return take_next(dataset, *next);
    if (!stop && refused->type == "source-replaced" && next->print.ranged) continue;
    drop_next(dataset);
    return stop ? pipeline::kCancelled : stays(*refused);
  }
}

/// From here on what was made of the raster before is gone.
proto::Result<void> JobQueue::take_next(const Dataset& dataset, const Fetched& next) {
  const fs::path folder = layout_.dataset(dataset.id);
  std::error_code error;
  // In an order in which a service that is killed finds a build that is done, or one that is to be done, or a raster that is to
  // be fetched.
  registry_.set_state(dataset.id, State::queued, std::nullopt);
  for (const fs::path& store : {layout_.store(dataset.id), layout_.provisional(dataset.id)})
    pipeline::remove_store(store.string());
  // What is there of the one before goes first: a map that is another's would take holes for heights.
  const fs::path file = folder / dataset.raster;
  for (const fs::path& before : {file, map_of(file), folder / kRasters}) fs::remove_all(before, error);
  const std::string note = updates::print_json(next.print).dump(1, ' ', false, Json::error_handler_t::replace) + "\n";
  if (!raster::write_whole((folder / kFetchedFile).string(), note).ok())
    return cannot("what was fetched for " + dataset.id + " cannot be written down");
  fs::remove(folder / kListedFile, error);
  if (const auto noted = next.listed ? updates::write_listed(folder, *next.listed) : proto::Result<void>(); !noted) return noted;
  if (next.print.ranged) fs::rename(map_of(next.file), map_of(file), error);
  if (next.listed && !error) fs::rename(next.rasters, folder / kRasters, error);
  if (error || !raster::put_in_place(next.file, file))
    return cannot("the raster of " + dataset.id +
                  " cannot be put into its place: " + (error ? error.message() : std::strerror(errno)));
  looked_at_.forget(dataset.id);
  published_(dataset.id);
  return {};
}

}  // namespace cordillera::server
