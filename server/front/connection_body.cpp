// The body of a request: from the socket, through a pipe, to the thread that handles the request.
#include <boost/asio/buffer.hpp>

#include "server/front/connection.h"
#include "server/front/loop.h"

namespace cordillera::server::front {
namespace {

constexpr std::string_view kContinue = "HTTP/1.1 100 Continue\r\n\r\n";

}  // namespace

void Connection::begin_with_body(Head head) {
  framing_.emplace(head);
  expects_continue_ = head.expects_continue;
  body_wanted_ = body_late_ = false;
  body_pace_.start();
  if (const auto problem = coding_problem(request_)) {
    by_front_ = true;
    Response response = refusal(*problem);
    response.set("Accept-Encoding", kCodings);
    return respond(std::move(response));
  }
  const auto self = shared_from_this();
  // The connection holds the pipe, so the pipe must not hold the connection.
  pipe_ = std::make_shared<BodyPipe>([weak = weak_from_this()] {
    if (const auto still = weak.lock()) still->later([still] { still->want_body(); });
  });
  const std::string coding = request_.header("content-encoding").value_or("");
  if (!coding.empty()) request_.sent = std::make_shared<std::uint64_t>(0), request_.misread = std::make_shared<bool>(false);
  const auto read = [pipe = pipe_, sent = request_.sent](const Request::Sink& sink) {
    while (const auto piece = pipe->pop()) {
      if (sent) *sent += piece->size();
      if (!sink(*piece)) return false;
    }
    return pipe->whole();
  };
  request_.read_body = decoding(coding, read, request_.misread);
  const auto taken = shared_.takers.run(network_, [self] { self->make_answer(); });
  if (taken == Workers::Taken::yes) return;
  if (taken == Workers::Taken::full)
    return respond_with({"service-busy", "the service receives too many bodies", "trying again later", ""});
  respond_with({"too-many-uploads", "this address sends too many bodies at a time",
                "at most " + std::to_string(shared_.limits.uploads_per_client), ""});
}

/// The handler asks for the body, or for more of it.
void Connection::want_body() {
  if (state_ != State::handling || !framing_) return;
  if (expects_continue_ && !body_wanted_) {
    boost::system::error_code error;
    if (socket_.write_some(boost::asio::buffer(kContinue), error) != kContinue.size()) return close();
  }
  body_wanted_ = true;
  feed_body();
}

void Connection::feed_body() {
  if (!in_.empty()) {
    const std::string bytes = std::move(in_);
    in_.clear();
    return take_body(bytes);
  }
  if (framing_->done()) return;
  body_pace_.wait(Clock::now());
  await_bytes();
}

void Connection::take_body(std::string_view bytes) {
  if (!framing_ || framing_->done()) return;
  body_pace_.moved(bytes.size(), Clock::now());
  std::string piece;
  const std::size_t used = framing_->take(bytes, &piece);
  in_.append(bytes.substr(used));
  const bool room = pipe_->push(std::move(piece));
  if (framing_->broken()) return end_body(BodyPipe::End::broken);
  if (framing_->done()) return end_body(BodyPipe::End::whole);
  if (room) feed_body();
}

/// What is here already of a body that nobody wants: a small one does not cost the connection.
void Connection::skip_body() {
  std::string unwanted;
  in_.erase(0, framing_->take(in_, &unwanted));
}

void Connection::end_body(BodyPipe::End end) {
  if (end == BodyPipe::End::broken) {
    keep_ = false;
    linger_ = true;
    framing_.reset();
  }
  body_pace_.start();
  if (pipe_) pipe_->end(end);
}

}  // namespace cordillera::server::front
