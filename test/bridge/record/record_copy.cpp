// record_copy IN.mcap OUT.mcap COMPRESSION CHUNK_BYTES: reads one file with our reader and writes another one
// with our writer, and metadata.yaml beside it. record_copy schemas OUT.mcap: a file with a message of each
// type that is compiled in.
#include <fmt/format.h>

#include <cstdio>
#include <filesystem>
#include <fstream>
#include <stdexcept>

#include "bridge/messages/types/type_library.hpp"
#include "bridge/record/bag_metadata.hpp"
#include "bridge/record/mcap_reader.hpp"
#include "bridge/record/mcap_writer.hpp"
#include "bridge/record/ros2msg.hpp"

namespace {

using namespace trestle;
using namespace trestle::record;

void check(const std::error_code& error) {
  if (error) {
    throw std::system_error{error};
  }
}

Compression compression_of(const std::string& name) {
  return compression_in_file(name == "none" ? "" : name).value();
}

void copy(const std::string& from, const std::string& to, const std::string& compression, std::size_t chunk) {
  McapReader in{from};
  const auto overview = in.overview();
  if (!overview) {
    throw std::runtime_error{to_string(overview.error())};
  }
  McapWriter out{to, {.compression = compression_of(compression), .chunk_bytes = chunk}};
  for (const auto& [id, schema] : overview->schemas) {
    out.add(schema);
  }
  for (const auto& [id, channel] : overview->channels) {
    out.add(channel);
  }
  Statistics found;
  for (;;) {
    const auto message = in.next();
    if (!message) {
      throw std::runtime_error{to_string(message.error())};
    }
    if (!*message) {
      break;
    }
    check(out.write(**message));
    found.add(**message);
  }
  check(out.add_metadata("of the test", {{"drops", "none"}}));
  check(out.finish());
  if (found.messages != overview->statistics.messages ||
      found.by_channel != overview->statistics.by_channel) {
    throw std::runtime_error{"the statistics are not what the file holds"};
  }
  std::vector<BagTopic> topics;
  for (const auto& [id, channel] : overview->channels) {
    if (channel.encoding == "cdr") {
      const auto qos = channel.metadata.find("offered_qos_profiles");
      topics.push_back({.name = channel.topic,
                        .type = overview->schemas.at(channel.schema).name,
                        .qos = qos == channel.metadata.end() ? "" : qos->second,
                        .messages = found.by_channel[id]});
    }
  }
  const std::filesystem::path path{to};
  std::ofstream{path.parent_path() / "metadata.yaml"}
      << bag_metadata(topics, {{path.filename(), found.start, found.end, found.messages}});
  fmt::print("{} messages{}{}\n", found.messages, overview->has_summary ? "" : ", no summary",
             in.cut_off() ? fmt::format(", cut off at {}", *in.cut_off()) : "");
}

void write_schemas(const std::string& to) {
  McapWriter out{to, {}};
  messages::TypeLibrary types;
  std::uint16_t id = 0;
  for (const std::string& name : messages::TypeLibrary::builtin_names()) {
    if (name.find("/msg/") == std::string::npos) {
      continue;
    }
    const auto tree = types.resolve(name);
    ++id;
    out.add(Schema{.id = id, .name = name, .encoding = ros2msg_encoding, .data = ros2msg(tree.value())});
    out.add(Channel{.id = id, .schema = id, .topic = "/" + name, .encoding = "cdr"});
    check(out.write({.channel = id, .log_time = id, .publish_time = id, .data = {}}));
  }
  check(out.finish());
}

}  // namespace

int main(int argc, char** argv) {
  const std::vector<std::string> arguments(argv + 1, argv + argc);
  try {
    if (arguments.size() == 4) {
      copy(arguments[0], arguments[1], arguments[2], std::stoul(arguments[3]));
    } else if (arguments.size() == 2 && arguments[0] == "schemas") {
      write_schemas(arguments[1]);
    } else {
      return 2;
    }
  } catch (const std::exception& error) {
    fmt::print(stderr, "{}\n", error.what());
    return 1;
  }
  return 0;
}
