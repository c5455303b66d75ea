#pragma once
#include <string>
#include <vector>

#include "bridge/inspect/decode/message_decoder.hpp"

namespace trestle::test {

/// Collects what a decoder prints.
struct Printed {
  std::vector<inspect::Json> objects;

  [[nodiscard]] inspect::MessageDecoder::Hooks hooks() {
    return {[this](const inspect::Json& object) { objects.push_back(object); }, {}};
  }
  /// One line for each object: "SERVICE.METHOD@OFFSET" of a message, with "!NAME@OFFSET" for its error.
  [[nodiscard]] std::vector<std::string> summary() const {
    std::vector<std::string> lines;
    for (const inspect::Json& object : objects) {
      std::string line;
      if (object.contains("payload")) {
        line += object["service"].get<std::string>().substr(2);
        line += '.';
        line += object["method"].get<std::string>().substr(2);
        line += '@';
        line += std::to_string(object["offset"].get<std::uint64_t>());
      }
      if (object.contains("error")) {
        line += '!';
        line += object["error"]["name"].get<std::string>();
        line += '@';
        line += std::to_string(object["error"]["offset"].get<std::uint64_t>());
      }
      lines.push_back(line);
    }
    return lines;
  }
};

}  // namespace trestle::test
