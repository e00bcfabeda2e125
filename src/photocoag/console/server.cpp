#include "photocoag/console/server.hpp"

#include <fmt/format.h>
#include <libwebsockets.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <exception>

#include "photocoag/console/clients.hpp"
#include "photocoag/console/file_sender.hpp"
#include "photocoag/console/foxglove.hpp"
#include "photocoag/console/token.hpp"
#include "photocoag/core/error.hpp"

namespace photocoag {
namespace {

constexpr const char* kLoopback = "127.0.0.1";
constexpr int kMostLines = 20;              // logged per kind of refusal; the rest is only counted
constexpr unsigned kHeaderPatience = 3;     // s, for a request to be complete
constexpr std::uint16_t kNotAllowed = 403;  // HTTP
constexpr std::uint16_t kNotFound = 404;    // HTTP
constexpr std::uint16_t kOnlyGet = 405;     // HTTP
constexpr std::uint16_t kTooManyNow = 503;  // HTTP
constexpr std::size_t kMostHeader = 256;    // bytes of a header that are read

std::string header(lws* wsi, lws_token_indexes which) {
  std::array<char, kMostHeader> text{};
  const int length = lws_hdr_copy(wsi, text.data(), static_cast<int>(text.size()), which);
  return length > 0 ? std::string(text.data(), static_cast<std::size_t>(length)) : std::string();
}

void quiet(int, const char*) {}

}  // namespace

std::uint64_t Refusals::total() const noexcept {
  return origin + token + crowd + oversized + malformed + flood + slow;
}

/// Everything that belongs to the server's thread.
struct ConsoleServer::Impl {
  struct Timer {
    lws_sorted_usec_list_t entry;  // first: lws hands back its address
    Impl* owner;
  };

  ServerSettings settings;
  ServerHooks hooks;
  Refusals refusals;
  std::map<std::atomic<std::uint64_t>*, int> lines;
  lws_context* context = nullptr;
  lws_vhost* vhost = nullptr;
  std::array<lws_protocols, kFoxgloveProtocols.size() + 2> protocols{};
  std::map<lws*, WebClient> clients;
  FileSender files;
  std::map<lws*, bool> open;  // every connection
  int next_id = 1;
  Timer timer{};
  std::uint16_t port = 0;

  ~Impl() {
    if (context != nullptr) lws_context_destroy(context);
  }

  void refuse(std::atomic<std::uint64_t>& count, std::string_view what) {
    ++count;
    const int line = ++lines[&count];
    if (!hooks.log || line > kMostLines) return;
    hooks.log(fmt::format("refused   {}{}", what,
                          line == kMostLines ? "; more of these are counted, not logged" : ""));
  }

  static bool is_foxglove(lws* wsi) {
    const lws_protocols* protocol = lws_get_protocol(wsi);
    return protocol != nullptr && std::string_view(protocol->name).starts_with("foxglove.");
  }

  bool allowed(const std::string& origin, const std::string& ours, bool foxglove) const {
    const auto& others = settings.foxglove_origins;
    return origin.empty() || origin == "http://" + ours ||
           (foxglove && std::find(others.begin(), others.end(), origin) != others.end());
  }

  // Rejects browsers that came under another host name (DNS rebinding) or from another page.
  bool from_here(lws* wsi, bool foxglove = false) {
    const std::string host = header(wsi, WSI_TOKEN_HOST);
    const std::string origin = header(wsi, WSI_TOKEN_ORIGIN);
    for (const char* name : {kLoopback, "localhost"}) {
      const std::string ours = fmt::format("{}:{}", name, port);
      const bool told = lws_hdr_total_length(wsi, WSI_TOKEN_ORIGIN) > 0;
      if (told && origin.empty()) break;  // longer than what is read
      if (host == ours && allowed(origin, ours, foxglove)) return true;
    }
    refuse(refusals.origin,
           fmt::format("a request for host \"{:.80}\" from \"{:.80}\"", host, origin));
    return false;
  }

  bool has_token(lws* wsi) {
    std::array<char, kMostHeader> text{};
    const char* value =
        lws_get_urlarg_by_name(wsi, "token=", text.data(), static_cast<int>(text.size()));
    if (value != nullptr && same_secret(value, settings.token)) return true;
    refuse(refusals.token, value == nullptr ? "no token" : "a wrong token");
    return false;
  }

  static int answer(lws* wsi, std::uint16_t code) {
    lws_return_http_status(wsi, code, nullptr);
    return -1;
  }

  // Before the connection becomes a WebSocket.
  int may_upgrade(lws* wsi) {
    const bool foxglove = is_foxglove(wsi);
    if (foxglove && hooks.foxglove == nullptr) return answer(wsi, kNotFound);
    if (!from_here(wsi, foxglove) || !has_token(wsi)) return answer(wsi, kNotAllowed);
    if (clients.size() >= static_cast<std::size_t>(settings.limits.clients)) {
      refuse(refusals.crowd, fmt::format("a client beyond {}", settings.limits.clients));
      return answer(wsi, kTooManyNow);
    }
    return 0;
  }

  int came(lws* wsi) {
    const bool foxglove = is_foxglove(wsi);
    ServerLimits limits = settings.limits;
    if (foxglove) limits.message_bytes = limits.foxglove_bytes;
    WebClient& client = clients.emplace(wsi, WebClient(next_id++, limits, foxglove)).first->second;
    for (const std::string& text :
         foxglove ? hooks.foxglove->came(client.id()) : hooks.came(client.id())) {
      push(wsi, client, packed(text));
    }
    return 0;
  }

  static WebClient::Message packed(std::string_view text, bool binary = false) {
    auto message = std::make_shared<WebClient::Bytes>();
    message->binary = binary;
    message->bytes.resize(LWS_PRE + text.size());
    std::memcpy(message->bytes.data() + LWS_PRE, text.data(), text.size());
    return message;
  }

  void push(lws* wsi, WebClient& client, const WebClient::Message& message) {
    if (client.overflowed()) return;
    if (client.push(message)) {
      lws_callback_on_writable(wsi);
      return;
    }
    refuse(refusals.slow, fmt::format("client {}: it does not take what is sent", client.id()));
    lws_set_timeout(wsi, PENDING_TIMEOUT_USER_REASON_BASE, LWS_TO_KILL_ASYNC);
  }

  int close_for(lws* wsi, std::atomic<std::uint64_t>& count, lws_close_status status,
                const std::string& why) {
    refuse(count, why);
    lws_close_reason(wsi, status, nullptr, 0);
    return -1;
  }

  int received(lws* wsi, const char* bytes, std::size_t count) {
    WebClient& client = clients.at(wsi);
    const std::string who = fmt::format("client {}: ", client.id());
    if (lws_frame_is_binary(wsi) != 0) {
      return close_for(wsi, refusals.malformed, LWS_CLOSE_STATUS_UNACCEPTABLE_OPCODE,
                       who + "a binary message");
    }
    if (!client.receive({bytes, count}, lws_remaining_packet_payload(wsi))) {
      return close_for(wsi, refusals.oversized, LWS_CLOSE_STATUS_MESSAGE_TOO_LARGE,
                       fmt::format("{}a message above {} bytes", who,
                                   client.foxglove() ? settings.limits.foxglove_bytes
                                                     : settings.limits.message_bytes));
    }
    if (lws_is_final_fragment(wsi) == 0 || lws_remaining_packet_payload(wsi) > 0) return 0;
    if (!client.allow_message(lws_now_usecs())) {
      return close_for(wsi, refusals.flood, LWS_CLOSE_STATUS_POLICY_VIOLATION,
                       fmt::format("{}more than {} messages in a second", who,
                                   settings.limits.messages_per_second));
    }
    const std::string text = client.take_received();
    std::string reply;
    bool good = true;
    if (client.foxglove()) {
      auto [understood, words] = hooks.foxglove->said(client.id(), text);
      good = understood;
      reply = std::move(words);
      if (good && reply.empty()) return 0;
    } else {
      reply = hooks.said(client.id(), text);
      good = !reply.empty();
    }
    if (!good) {
      return close_for(wsi, refusals.malformed, LWS_CLOSE_STATUS_POLICY_VIOLATION,
                       who + "a message that is no command");
    }
    push(wsi, client, packed(reply));
    return 0;
  }

  int writable(lws* wsi) {
    WebClient& client = clients.at(wsi);
    do {
      const WebClient::Message message = client.pop();
      if (!message) return 0;
      const std::size_t count = message->bytes.size() - LWS_PRE;
      if (lws_write(wsi, message->bytes.data() + LWS_PRE, count,
                    message->binary ? LWS_WRITE_BINARY : LWS_WRITE_TEXT) < 0) {
        return -1;
      }
    } while (lws_send_pipe_choked(wsi) == 0);
    if (!client.idle()) lws_callback_on_writable(wsi);
    return 0;
  }

  void gone(lws* wsi) {
    const auto found = clients.find(wsi);
    if (found == clients.end()) return;
    const int id = found->second.id();
    const bool foxglove = found->second.foxglove();
    clients.erase(found);
    if (foxglove) return hooks.foxglove->left(id);
    if (hooks.left) hooks.left(id);
  }

  // Finds a file and sends its headers; its data follow as the client accepts them.
  int request(lws* wsi, std::string_view path) {
    if (!from_here(wsi)) return answer(wsi, kNotAllowed);
    if (lws_hdr_total_length(wsi, WSI_TOKEN_GET_URI) == 0) return answer(wsi, kOnlyGet);
    std::optional<WebFile> file;
    if (path.starts_with("/runs/")) {
      if (!has_token(wsi)) return answer(wsi, kNotAllowed);
      file = hooks.run_file(path.substr(6));
    } else {
      file = hooks.file(path);
    }
    if (!file) return answer(wsi, kNotFound);
    return files.begin(wsi, std::move(*file)) ? 0 : -1;
  }

  void tick() {
    for (const std::string& text : hooks.tick()) {
      const WebClient::Message message = packed(text);
      for (auto& [wsi, client] : clients) {
        if (!client.foxglove()) push(wsi, client, message);
      }
    }
    for (auto& [wsi, client] : clients) {
      if (!client.foxglove()) continue;
      for (const std::string& bytes : hooks.foxglove->messages(client.id())) {
        push(wsi, client, packed(bytes, true));
      }
    }
    if (hooks.foxglove != nullptr) hooks.foxglove->forget();
    schedule();
  }
  void schedule() {
    timer.owner = this;
    lws_sul_schedule(
        context, 0, &timer.entry,
        [](lws_sorted_usec_list_t* entry) { reinterpret_cast<Timer*>(entry)->owner->tick(); },
        static_cast<lws_usec_t>(settings.limits.tick_s * 1e6));
  }

  int on_event(lws* wsi, lws_callback_reasons reason, void* in, std::size_t length) {
    switch (reason) {
      case LWS_CALLBACK_FILTER_NETWORK_CONNECTION:
        if (open.size() < static_cast<std::size_t>(settings.limits.connections)) return 0;
        refuse(refusals.crowd, fmt::format("a connection beyond {}", settings.limits.connections));
        return -1;
      case LWS_CALLBACK_SERVER_NEW_CLIENT_INSTANTIATED:
        open[wsi] = true;
        return 0;
      case LWS_CALLBACK_WSI_DESTROY:
        gone(wsi);
        files.forget(wsi);
        open.erase(wsi);
        return 0;
      case LWS_CALLBACK_FILTER_PROTOCOL_CONNECTION:
        return may_upgrade(wsi);
      case LWS_CALLBACK_ESTABLISHED:
        return came(wsi);
      case LWS_CALLBACK_RECEIVE:
        return received(wsi, static_cast<const char*>(in), length);
      case LWS_CALLBACK_SERVER_WRITEABLE:
        return writable(wsi);
      case LWS_CALLBACK_CLOSED:
        gone(wsi);
        return 0;
      case LWS_CALLBACK_HTTP:
        return request(wsi, {static_cast<const char*>(in), length});
      case LWS_CALLBACK_HTTP_WRITEABLE:
        return files.go_on(wsi) ? 0 : -1;
      default:
        return lws_callback_http_dummy(wsi, reason, nullptr, in, length);
    }
  }

  // Nothing that a client sends may end the program: a connection that throws is closed.
  static int callback(lws* wsi, lws_callback_reasons reason, void*, void* in, std::size_t length) {
    const lws_context* context = wsi == nullptr ? nullptr : lws_get_context(wsi);
    auto* const self =
        context == nullptr
            ? nullptr
            : static_cast<Impl*>(lws_context_user(const_cast<lws_context*>(context)));
    if (self == nullptr) return 0;
    try {
      return self->on_event(wsi, reason, in, length);
    } catch (const std::exception& error) {
      if (self->hooks.log) self->hooks.log(fmt::format("server    {}", error.what()));
      return -1;
    }
  }

  void listen() {
    lws_set_log_level(LLL_ERR, quiet);
    protocols[0] = {.name = "photocoag",
                    .callback = callback,
                    .per_session_data_size = 0,
                    .rx_buffer_size = 1024,
                    .id = 0,
                    .user = nullptr,
                    .tx_packet_size = 0};
    for (std::size_t k = 0; k < kFoxgloveProtocols.size(); ++k) {
      protocols[k + 1] = protocols[0];
      protocols[k + 1].name = kFoxgloveProtocols[k];
    }
    lws_context_creation_info info{};
    info.port = CONTEXT_PORT_NO_LISTEN;
    info.options = LWS_SERVER_OPTION_EXPLICIT_VHOSTS | LWS_SERVER_OPTION_VALIDATE_UTF8;
    info.gid = static_cast<decltype(info.gid)>(-1);
    info.uid = static_cast<decltype(info.uid)>(-1);
    info.fd_limit_per_thread = static_cast<unsigned>(settings.limits.connections) + 24;
    info.pt_serv_buf_size = 8192;
    info.user = this;
    context = lws_create_context(&info);
    if (context == nullptr) throw Error("the console's server cannot be started");
    info.options = LWS_SERVER_OPTION_VALIDATE_UTF8 | LWS_SERVER_OPTION_DISABLE_IPV6;
    info.port = settings.port;
    info.iface = kLoopback;
    info.protocols = protocols.data();
    info.vhost_name = kLoopback;
    info.server_string = "photocoag";
    info.timeout_secs = kHeaderPatience;
    info.keepalive_timeout = kHeaderPatience;
    vhost = lws_create_vhost(context, &info);
    const int bound = vhost == nullptr ? 0 : lws_get_vhost_listen_port(vhost);
    if (bound <= 0) {
      throw Error(ErrorParts{.where = "--port",
                             .problem = "the port cannot be opened",
                             .found = fmt::format("{}", settings.port),
                             .accepted = "a port that is free; 0: any"});
    }
    port = static_cast<std::uint16_t>(bound);
  }
};

ConsoleServer::ConsoleServer(ServerSettings settings, ServerHooks hooks)
    : impl_(std::make_unique<Impl>()) {
  impl_->settings = std::move(settings);
  impl_->hooks = std::move(hooks);
  impl_->listen();
  port_ = impl_->port;
  alive_ = true;
  thread_ = std::thread([this] {
    impl_->schedule();
    while (!stop_.load(std::memory_order_relaxed) && lws_service(impl_->context, 0) >= 0) {
    }
    alive_ = false;
  });
}

ConsoleServer::~ConsoleServer() { stop(); }

void ConsoleServer::stop() noexcept {
  stop_ = true;
  if (!thread_.joinable()) return;
  lws_cancel_service(impl_->context);
  thread_.join();
  lws_context_destroy(impl_->context);
  impl_->context = nullptr;
}

std::string ConsoleServer::address() const {
  return fmt::format("http://{}:{}/#token={}", kLoopback, port_, impl_->settings.token);
}

std::string ConsoleServer::foxglove_address() const {
  return fmt::format("ws://{}:{}/?token={}", kLoopback, port_, impl_->settings.token);
}

const Refusals& ConsoleServer::refusals() const noexcept { return impl_->refusals; }

}  // namespace photocoag
