// The answer to a request: at once, later, or piece by piece.
#include <poll.h>

#include <algorithm>
#include <array>
#include <boost/asio/buffer.hpp>
#include <charconv>

#include "server/front/connection.h"
#include "server/front/loop.h"
#include "server/front/message/answer_head.h"
#include "server/log/log.h"

namespace cordillera::server::front {
namespace {

constexpr auto kToBegin =
    std::chrono::seconds(2);  // who has only closed his side reads still, and seldom has to wait for so long
constexpr std::size_t kLarge = std::size_t{64} << 10;  // less is soon in the system's own buffers

std::string chunk(const std::string& piece) {
  std::array<char, 20> size{};
  const auto end = std::to_chars(size.data(), size.data() + size.size(), piece.size(), 16).ptr;
  return std::string(size.data(), end).append("\r\n").append(piece).append("\r\n");
}

}  // namespace

/// Something is wrong that the API does not know of.
void Connection::respond_with(const proto::Problem& problem) {
  by_front_ = true;
  respond(refusal(problem));
}

void Connection::respond(Response response) {
  if (state_ == State::closed) return;
  counted_ = counted_ || response.counted;
  if (body_late_) {
    body_late_ = false;
    return respond_with({"request-timeout", "the body came too slowly",
                         "at least " + std::to_string(shared_.limits.min_rate) + " bytes a second", ""});
  }
  if (framing_ && !framing_->done() && !expects_continue_) skip_body();
  const bool body_left = framing_ ? !framing_->done() : linger_;
  if (response.next_piece || response.later) {
    stream_share_ = shared_.streams.take(network_, shared_.limits.streams_per_client);
    if (!stream_share_) {
      return respond_with({"too-many-streams", "this address waits for too much at a time",
                           "at most " + std::to_string(shared_.limits.streams_per_client) + " event streams and waiting requests",
                           ""});
    }
  }
  if (response.later) {
    awaited_ = std::move(response.later);
    state_ = State::waiting;
    return ask_again();
  }
  if (response.rest) return make_rest(std::move(response.rest));
  if (body_left) keep_ = false, linger_ = true;  // where the next request would begin is behind bytes that nobody reads
  if (shared_.stopping) keep_ = false;
  const bool head_only = request_.method == "HEAD" || is_bodiless(response.status);
  if (!head_only && !take_out(response)) return respond_with(too_much_unsent());
  const Ending ending = !response.next_piece || response.length ? Ending::length : old_ ? Ending::connection : Ending::chunks;
  if (ending == Ending::connection) keep_ = false;
  status_ = response.status;
  problem_ = response.problem;
  out_head_ = answer_head(response, {ending, keep_, old_, loop_.date()});
  out_at_ = out_bytes_ = 0;
  chunks_ = ending == Ending::chunks;
  pieces_ = head_only ? nullptr : std::move(response.next_piece);
  pieces_left_ = pieces_ ? response.length.value_or(0) : 0;
  answer_pace_.start(std::max<std::uint64_t>(out_body_ ? out_body_->size() : 0, pieces_left_));
  write();
}

/// Takes the body over; false: it is large, and there is no room for it.
bool Connection::take_out(Response& response) {
  if (response.bytes().empty()) return true;
  out_body_ = response.shared ? response.shared : std::make_shared<const std::string>(std::move(response.body));
  response.shared = out_body_;
  if (out_body_->size() < kLarge) return true;
  unsent_ = shared_.unsent.take(network_, out_body_);
  if (!unsent_) out_body_ = nullptr;
  return unsent_ != nullptr;
}

/// On a worker's thread.
void Connection::make_answer() {
  if (begun_.exchange(true)) return;
  try {
    later([self = shared_from_this(), response = answer_of(shared_, request_, route_)]() mutable {
      self->respond(std::move(response));
    });
  } catch (const std::exception&) {
    failed_ = true;  // no memory even for saying so: the loop sees it at its next look
  }
}

/// What waited long for its turn takes it like any other request, among the workers: the loop has other connections.
void Connection::make_rest(std::function<Response()> rest) {
  begun_ = false;
  const auto taken = shared_.makers.run(network_, [self = shared_from_this(), rest = std::move(rest)] {
    if (self->begun_.exchange(true)) return;
    try {
      self->later(
          [self, response = rest_of(self->shared_, self->request_, rest)]() mutable { self->respond(std::move(response)); });
    } catch (const std::exception&) {
      self->failed_ = true;  // as above
    }
  });
  if (taken != Workers::Taken::yes) respond_with({"service-busy", "the service has too much to do", "trying again later", ""});
}

/// Whether it has closed its side. It may read still, so it is answered; but it waits no longer, and its place is another's.
bool Connection::client_left() {
  pollfd socket{socket_.native_handle(), POLLRDHUP, 0};
  if (poll(&socket, 1, 0) <= 0) return false;
  keep_ = false;
  return true;
}

/// What only reads and waits for a worker is not made for a client that has left: others wait behind it. A change is made all the
/// same.
void Connection::leave_if_unwanted(Clock::time_point now) {
  const bool reads = request_.method == "GET" || request_.method == "HEAD";
  if (reads && !begun_ && now - asked_ > kToBegin && client_left() && !begun_.exchange(true)) close();
}

void Connection::ask_again(Patience patience) {
  std::optional<Response> response;
  try {
    response = awaited_(patience);
  } catch (const std::exception& error) {
    log_warning(request_.method + " " + request_.path.substr(0, 300) + ": " + error.what());
    response = refusal({"internal", "the service failed to answer this request", "", ""});
  }
  if (!response) return;
  awaited_ = nullptr;
  stream_share_ = nullptr;
  state_ = State::handling;
  respond(std::move(*response));
}

/// The next piece of a stream, if there is one by now.
void Connection::pump() {
  const auto piece = pieces_();
  state_ = State::streaming;
  if (piece && piece->empty()) return;
  if (pieces_left_ > 0) {
    if (!piece || piece->size() > pieces_left_)
      return close();  // what was promised is not there: the client must not take it for the whole
    pieces_left_ -= piece->size();
    if (pieces_left_ == 0) pieces_ = nullptr;
  }
  out_head_.clear();
  out_at_ = 0;
  if (piece) {
    out_body_ = std::make_shared<const std::string>(chunks_ ? chunk(*piece) : *piece);
  } else {
    out_body_ = std::make_shared<const std::string>(chunks_ ? "0\r\n\r\n" : "");
    pieces_ = nullptr;
  }
  write();
}

/// Until all is out or the system takes no more.
void Connection::write() {
  state_ = State::writing;
  static const std::string kNothing;
  const std::string& body = out_body_ ? *out_body_ : kNothing;
  const std::size_t all = out_head_.size() + body.size();
  while (out_at_ < all) {
    const std::size_t in_head = std::min(out_at_, out_head_.size());
    const std::array<boost::asio::const_buffer, 2> rest = {boost::asio::buffer(out_head_) + in_head,
                                                           boost::asio::buffer(body) + (out_at_ - in_head)};
    boost::system::error_code error;
    const std::size_t count = socket_.write_some(rest, error);
    if (error == boost::asio::error::would_block) {
      answer_pace_.wait(Clock::now());
      socket_.async_wait(boost::asio::ip::tcp::socket::wait_write,
                         [self = shared_from_this()](const boost::system::error_code& failed) {
                           if (!failed && self->state_ == State::writing) self->guarded([&] { self->write(); });
                         });
      return;
    }
    if (error) return close();
    if (answer_pace_.waiting()) answer_pace_.moved(count, Clock::now());
    out_at_ += count;
    out_bytes_ += count;
  }
  if (!pieces_) return answered();
  if (pieces_left_ == 0) return pump();
  later([self = shared_from_this()] {  // other connections first
    if (self->state_ == State::writing && self->pieces_) self->pump();
  });
}

void Connection::answered() {
  report(true);
  out_head_.clear();
  out_body_ = nullptr;
  unsent_ = nullptr;
  stream_share_ = nullptr;
  pipe_ = nullptr;
  framing_.reset();
  request_ = {};
  if (linger_) return linger();
  if (!keep_) return close();
  state_ = State::head;
  scan_ = {};
  since_ = Clock::now();
  if (in_.empty()) return await_bytes();
  // What was sent ahead waits for its turn behind other connections.
  later([self = shared_from_this()] {
    if (self->state_ == State::head && !self->reading_) self->read_head_or_wait();
  });
}

void Connection::report(bool whole) {
  if (!shared_.on_served) return;
  const std::chrono::duration<double> took = Clock::now() - asked_;
  shared_.on_served({request_.method, request_.path, request_.client, problem_, status_, out_bytes_, took.count(), by_front_,
                     counted_, counted_ ? "" : route_name(route_), whole});
}

}  // namespace cordillera::server::front
