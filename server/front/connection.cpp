#include "server/front/connection.h"

#include <boost/asio/buffer.hpp>

#include "server/access/client_address.h"
#include "server/api/requests/typed_by_hand.h"
#include "server/front/loop.h"
#include "server/log/log.h"

namespace cordillera::server::front {
namespace {

using boost::asio::ip::tcp;
using Error = boost::system::error_code;

constexpr std::uint64_t kMostThrownAway = std::uint64_t{64} << 20;  // of a refused body, so that the client reads the refusal
constexpr auto kLingerSilence = std::chrono::seconds(3);
constexpr auto kLinger = std::chrono::seconds(30);

}  // namespace

Connection::Connection(Loop& loop, tcp::socket socket, std::shared_ptr<void> place, ClientCounts::Share share)
    : loop_(loop),
      shared_(loop.shared()),
      place_(std::move(place)),
      socket_(std::move(socket)),
      share_(std::move(share)),
      since_(Clock::now()),
      body_pace_(shared_.limits),
      answer_pace_(shared_.limits) {
  Error ignored;
  socket_.non_blocking(true, ignored);
  socket_.set_option(tcp::no_delay(true), ignored);
  peer_ = socket_.remote_endpoint(ignored).address().to_string();
}

void Connection::start() { await_bytes(); }

void Connection::refuse(const proto::Problem& problem) { refuse_head(problem); }

void Connection::await_bytes() {
  if (reading_ || state_ == State::closed) return;
  reading_ = true;
  socket_.async_wait(tcp::socket::wait_read, [self = shared_from_this()](const Error& error) {
    self->reading_ = false;
    if (!error) self->guarded([&] { self->on_readable(); });
  });
}

void Connection::on_readable() {
  if (state_ == State::closed) return;
  auto& scratch = loop_.scratch();
  Error error;
  // Requests sent ahead wait in the system's buffers, not in ours.
  const std::size_t most = state_ == State::head ? shared_.limits.head_bytes : scratch.size();
  const std::size_t count = socket_.read_some(boost::asio::buffer(scratch, most), error);
  if (error == boost::asio::error::would_block) return await_bytes();
  if (error) return on_end_of_input();
  const std::string_view bytes(scratch.data(), count);
  if (state_ == State::head) {
    if (in_.empty()) since_ = Clock::now();
    in_.append(bytes);
    read_head_or_wait();
  } else if (state_ == State::lingering) {
    thrown_away_ += count;
    last_byte_ = Clock::now();
    thrown_away_ > kMostThrownAway ? close() : await_bytes();
  } else {
    take_body(bytes);
  }
}

/// The client has sent its last byte. It may still read.
void Connection::on_end_of_input() {
  if (framing_ && state_ != State::lingering) return end_body(BodyPipe::End::broken);
  close();
}

void Connection::read_head_or_wait() {
  switch (scan_.look(in_, shared_.limits)) {
    case HeadScan::State::more: return await_bytes();
    case HeadScan::State::broken: return refuse_head(head_problem(scan_, shared_.limits));
    case HeadScan::State::whole: break;
  }
  auto head = read_head(std::string_view(in_).substr(0, scan_.size()), shared_.limits);
  in_.erase(0, scan_.size());
  if (!head) return refuse_head(head.problem());
  begin(std::move(head.value()));
}

void Connection::begin(Head head) {
  asked_ = Clock::now();
  request_ = std::move(head.request);
  request_.client = peer_;
  request_.client = access::client_address(request_, shared_.limits.trusted_proxies);
  network_ = access::share_of(request_.client);
  keep_ = head.keep_alive && !shared_.stopping;
  old_ = head.old;
  forget_answer();
  begun_ = false;
  state_ = State::handling;
  const bool takes_body = request_.method == "POST" || request_.method == "PUT" || request_.method == "PATCH";
  if (head.body != Head::Body::none && takes_body) {
    route_ = route_meant(request_);
    return begin_with_body(std::move(head));
  }
  if (head.body != Head::Body::none) keep_ = false, linger_ = true;  // a body that nobody reads
  request_.read_body = [](const Request::Sink&) { return true; };
  if (auto kept = kept_answer(shared_, request_)) return respond(std::move(*kept));
  route_ = route_meant(request_);
  if (shared_.api.is_quick(request_, route_)) return respond(answer_of(shared_, request_, route_));
  if (route_.is(RouteRow::kLarge) && shared_.unsent.full(network_)) return respond_with(too_much_unsent());
  const auto taken = shared_.makers.run(network_, [self = shared_from_this()] { self->make_answer(); });
  if (taken != Workers::Taken::yes) respond_with({"service-busy", "the service has too much to do", "trying again later", ""});
}

/// Of the request before this one.
void Connection::forget_answer() {
  route_ = {};
  by_front_ = counted_ = false;
  status_ = 0;
  problem_.clear();
}

/// What cannot be read, cannot be served; nor is it known where the next request would begin.
void Connection::refuse_head(const proto::Problem& problem) {
  asked_ = Clock::now();
  request_ = {};
  request_.method.clear();  // nobody knows it
  request_.client = peer_;
  network_ = access::share_of(peer_);
  forget_answer();
  keep_ = false;
  linger_ = true;
  state_ = State::handling;
  respond_with(problem);
}

void Connection::linger() {
  state_ = State::lingering;
  since_ = last_byte_ = Clock::now();
  in_.clear();
  framing_.reset();
  Error ignored;
  socket_.shutdown(tcp::socket::shutdown_send, ignored);
  await_bytes();
}

void Connection::tick(Clock::time_point now) {
  const HttpLimits& limits = shared_.limits;
  if (failed_) return close();
  switch (state_) {
    case State::head:
      if (in_.empty()) {
        if (now - since_ > limits.idle) close();
      } else if (now - since_ > limits.head) {
        refuse_head({"request-timeout", "the request did not come to its end",
                     "a head within " + std::to_string(limits.head.count()) + " seconds", ""});
      }
      break;
    case State::handling:
      if (body_pace_.too_slow(now)) {
        body_late_ = true;
        end_body(BodyPipe::End::broken);
      }
      leave_if_unwanted(now);
      break;
    case State::waiting: ask_again(client_left() ? Patience::none : Patience::more); break;
    case State::writing:
      if (answer_pace_.too_slow(now)) close();
      break;
    case State::streaming: pump(); break;
    case State::lingering:
      if (now - last_byte_ > kLingerSilence || now - since_ > kLinger) close();
      break;
    case State::closed: break;
  }
}

void Connection::changed() {
  if (state_ == State::waiting) ask_again();
  if (state_ == State::streaming) pump();
}

void Connection::finish() {
  keep_ = false;
  if (idle()) close();
  changed();
}

void Connection::close() {
  if (state_ == State::closed) return;
  const auto self = shared_from_this();
  const bool answering = state_ == State::waiting || state_ == State::writing || state_ == State::streaming;
  state_ = State::closed;
  if (pipe_) pipe_->end(BodyPipe::End::broken);
  awaited_ = nullptr;
  pieces_ = nullptr;
  share_ = stream_share_ = unsent_ = nullptr;
  out_body_ = nullptr;
  Error ignored;
  socket_.shutdown(tcp::socket::shutdown_both, ignored);
  socket_.close(ignored);
  place_ = nullptr;
  loop_.forget(self);
  if (answering) report(false);  // last: it may throw
}

void Connection::give_up(const char* why) {
  try {
    log_warning(request_.method + " " + request_.path.substr(0, 300) + ": the connection is left: " + why);
  } catch (const std::exception&) {
    // No memory for words either.
  }
  try {
    close();
  } catch (const std::exception&) {
    // It is closed all the same; only nobody is told.
  }
}

}  // namespace cordillera::server::front
