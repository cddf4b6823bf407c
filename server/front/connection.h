#pragma once
// One client's connection: requests in turn, each answered before the next is read.
#include <atomic>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/post.hpp>
#include <memory>
#include <optional>
#include <string>

#include "server/front/body_pipe.h"
#include "server/front/message/body_framing.h"
#include "server/front/message/head.h"
#include "server/front/pace.h"
#include "server/front/shared.h"

namespace cordillera::server::front {

class Loop;

/// Lives on its loop's thread; only what says so may be called from another one.
class Connection : public std::enable_shared_from_this<Connection> {
 public:
  /// share: of the client's connections; null: it has too many, and is told so.
  /// place: of the socket, given back when that is closed.
  Connection(Loop& loop, boost::asio::ip::tcp::socket socket, std::shared_ptr<void> place, ClientCounts::Share share);

  void start();
  /// Says why instead of serving.
  void refuse(const proto::Problem& problem);
  /// Time has passed.
  void tick(Clock::time_point now);
  /// Something happened that event streams and waiting answers may want to tell.
  void changed();
  /// The answer under way is the last.
  void finish();
  void close();

  /// Does it. Where that throws, for want of memory, this connection is left, and not all of them.
  template <class Work>
  void guarded(Work&& work) {
    try {
      work();
    } catch (const std::exception& error) { give_up(error.what()); }
  }

  bool idle() const { return state_ == State::head && in_.empty(); }
  bool lingering() const { return state_ == State::lingering; }
  Clock::time_point since() const { return since_; }
  bool closed() const { return state_ == State::closed; }

 private:
  enum class State : std::uint8_t {
    head,       ///< a request is awaited, or its head is being read
    handling,   ///< the API works; with a body, that is read meanwhile
    waiting,    ///< the answer is still to come
    writing,    ///< the answer goes out
    streaming,  ///< it is a stream, and has nothing to say now
    lingering,  ///< all is said; what the client still sends is thrown away, so that it reads the answer
    closed,
  };

  // Reading (connection.cpp).
  void await_bytes();
  void on_readable();
  void on_end_of_input();
  void read_head_or_wait();
  void begin(Head head);
  void refuse_head(const proto::Problem& problem);
  void forget_answer();
  void linger();

  // Bodies (connection_body.cpp).
  void begin_with_body(Head head);
  void want_body();
  void feed_body();
  void take_body(std::string_view bytes);
  void skip_body();
  void end_body(BodyPipe::End end);

  // Answers (connection_answer.cpp).
  void respond(Response response);
  void respond_with(const proto::Problem& problem);
  void ask_again(Patience patience = Patience::more);
  bool client_left();
  void leave_if_unwanted(Clock::time_point now);
  void pump();
  bool take_out(Response& response);
  void write();
  void answered();
  void report(bool whole);
  void make_answer();
  void make_rest(std::function<Response()> rest);
  void give_up(const char* why);

  /// From another thread: does it on the loop's.
  template <class Work>
  void later(Work work) {
    boost::asio::post(socket_.get_executor(),
                      [self = shared_from_this(), work = std::move(work)]() mutable { self->guarded(work); });
  }

  Loop& loop_;
  Shared& shared_;
  std::shared_ptr<void> place_;  ///< goes after the socket
  boost::asio::ip::tcp::socket socket_;
  std::string peer_;
  ClientCounts::Share share_, stream_share_;

  State state_ = State::head;
  Clock::time_point since_;  ///< of the state, or of the head's first byte
  std::string in_;           ///< read and not used yet
  HeadScan scan_;
  bool reading_ = false;

  Request request_;
  std::string network_;  ///< of the client, as limits count: see access::share_of
  Route route_;          ///< the request's; of nothing where its answer was kept or its head cannot be read
  Clock::time_point asked_;
  bool keep_ = true, linger_ = false, old_ = false;
  bool by_front_ = false;            ///< the answer is no answer of the API
  bool counted_ = false;             ///< the API has counted the request
  std::atomic<bool> failed_{false};  ///< there will be none
  std::atomic<bool> begun_{false};   ///< a worker makes it, or nobody will

  std::shared_ptr<BodyPipe> pipe_;
  std::optional<BodyFraming> framing_;
  bool expects_continue_ = false, body_wanted_ = false, body_late_ = false;
  Pace body_pace_;

  Response::Later awaited_;
  std::function<std::optional<std::string>()> pieces_;
  bool chunks_ = false;
  std::uint64_t pieces_left_ = 0;  ///< bytes that pieces still have, where their length was said
  std::string out_head_;
  std::shared_ptr<const std::string> out_body_;  ///< null: none
  AnswerBudget::Share unsent_;                   ///< of a large body
  std::size_t out_at_ = 0;
  std::uint64_t out_bytes_ = 0;
  int status_ = 0;
  std::string problem_;
  Pace answer_pace_;
  std::uint64_t thrown_away_ = 0;
  Clock::time_point last_byte_;
};

}  // namespace cordillera::server::front
