#include "photocoag/console/foxglove.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <iterator>
#include <limits>
#include <nlohmann/json.hpp>

#include "photocoag/console/messages.hpp"
#include "photocoag/core/build_info.hpp"
#include "photocoag/log/topics.hpp"

namespace photocoag {
namespace {

using Json = nlohmann::ordered_json;

std::string schema_of(const std::string& title, const std::vector<const CycleField*>& fields) {
  Json schema = {{"type", "object"}, {"title", title}};
  for (const CycleField* field : fields) {
    const char* type = field->type == FieldType::kReal   ? "number"
                       : field->type == FieldType::kWord ? "string"
                                                         : "integer";
    schema["properties"][std::string(field->name)] = {
        {"type", type}, {"description", fmt::format("unit {}", field->unit)}};
  }
  return schema.dump();
}

// All digits, so that values read back exactly; missing values are omitted.
std::string payload_of(const std::vector<const CycleField*>& fields, const LogRecord& record) {
  std::string text = "{";
  const auto add = [&](const CycleField* field, const auto& value) {
    fmt::format_to(std::back_inserter(text), "{}\"{}\":{}", text.size() > 1 ? "," : "", field->name,
                   value);
  };
  for (const CycleField* field : fields) {
    const std::uint64_t bits = field->get(record);
    if (field->type == FieldType::kWord) {
      add(field, fmt::format("\"{}\"", field->word(bits)));
    } else if (field->type == FieldType::kReal) {
      if (std::isfinite(std::bit_cast<double>(bits))) add(field, std::bit_cast<double>(bits));
    } else if (static_cast<std::int64_t>(bits) != LogRecord::kNoTime) {
      add(field, static_cast<std::int64_t>(bits));
    }
  }
  return text + "}";
}

void little_endian(std::string& to, std::uint64_t value, int bytes) {
  for (int k = 0; k < bytes; ++k) to += static_cast<char>(value >> (8 * k));
}

std::string status(std::string_view problem) {
  constexpr int kError = 2;
  return Json{{"op", "status"}, {"level", kError}, {"message", problem}}.dump();
}

std::uint64_t whole(const Json& json, const char* key) {
  constexpr std::uint64_t kNone = std::numeric_limits<std::uint64_t>::max();
  return json.is_object() && json.contains(key) && json[key].is_number_unsigned()
             ? json[key].get<std::uint64_t>()
             : kNone;
}

}  // namespace

FoxgloveFeed::FoxgloveFeed() {
  for (const CycleField* field : live_columns()) {
    const std::string topic(topic_of(field->name, field->unit, field->type == FieldType::kWord));
    const auto found = std::find_if(channels_.begin(), channels_.end(),
                                    [&](const Channel& one) { return one.topic == topic; });
    Channel& channel = found != channels_.end() ? *found : channels_.emplace_back();
    channel.topic = topic;
    channel.fields.push_back(field);
  }
}

std::string FoxgloveFeed::advertisement() const {
  Json channels = Json::array();
  for (std::size_t k = 0; k < channels_.size(); ++k) {
    const std::string name = "photocoag" + channels_[k].topic;
    channels.push_back({{"id", k + 1},
                        {"topic", channels_[k].topic},
                        {"encoding", "json"},
                        {"schemaName", name},
                        {"schema", schema_of(name, channels_[k].fields)},
                        {"schemaEncoding", "jsonschema"}});
  }
  return Json{{"op", "advertise"}, {"channels", channels}}.dump();
}

std::vector<std::string> FoxgloveFeed::came(int client) {
  clients_[client];
  const Json info = {{"op", "serverInfo"},
                     {"name", fmt::format("photocoag {}", version())},
                     {"capabilities", Json::array()},
                     {"metadata", {{"notice", std::string(kResearchNotice)}}}};
  return {info.dump(), advertisement()};
}

void FoxgloveFeed::left(int client) { clients_.erase(client); }

FoxgloveFeed::Reply FoxgloveFeed::said(int client, std::string_view text) {
  const Json json = Json::parse(text, nullptr, false);
  if (!json.is_object() || !json.contains("op") || !json["op"].is_string())
    return {.good = false, .text = {}};
  auto& subscribed = clients_[client];
  const std::string op = json["op"].get<std::string>();
  if (op == "subscribe" && json.contains("subscriptions") && json["subscriptions"].is_array()) {
    for (const Json& one : json["subscriptions"]) {
      const std::uint64_t channel = whole(one, "channelId"), id = whole(one, "id");
      if (channel == 0 || channel > channels_.size() ||
          id > std::numeric_limits<std::uint32_t>::max()) {
        return {.text = status("no such channel, or no id of a subscription")};
      }
      if (subscribed.contains(channel - 1)) {
        return {.text = status(fmt::format("channel {} is subscribed to already", channel))};
      }
      subscribed[channel - 1] = static_cast<std::uint32_t>(id);
    }
    return {};
  }
  if (op == "unsubscribe" && json.contains("subscriptionIds") &&
      json["subscriptionIds"].is_array()) {
    for (const Json& id : json["subscriptionIds"]) {
      std::erase_if(subscribed, [&](const auto& one) {
        return id.is_number_unsigned() && id.get<std::uint64_t>() == one.second;
      });
    }
    return {};
  }
  return {.text = status("this server only publishes: subscribe, unsubscribe")};
}

void FoxgloveFeed::add(const LogRecord& record, std::int64_t unix_ns) {
  for (std::size_t k = 0; k < channels_.size(); ++k) {
    const bool listening = std::any_of(clients_.begin(), clients_.end(), [k](const auto& client) {
      return client.second.contains(k);
    });
    if (listening) added_.push_back({k, unix_ns, payload_of(channels_[k].fields, record)});
  }
}

std::vector<std::string> FoxgloveFeed::messages(int client) const {
  std::vector<std::string> list;
  const auto found = clients_.find(client);
  if (found == clients_.end()) return list;
  constexpr char kMessageData = 1;
  for (const Added& one : added_) {
    const auto subscription = found->second.find(one.channel);
    if (subscription == found->second.end()) continue;
    std::string message(1, kMessageData);
    little_endian(message, subscription->second, 4);
    little_endian(message, static_cast<std::uint64_t>(one.unix_ns), 8);
    list.push_back(message + one.payload);
  }
  return list;
}

}  // namespace photocoag
