#pragma once
#include <string>
#include <vector>

#include "bridge/describe/model.hpp"

namespace trestle::describe {

/// A file that a writer made.
struct TextFile {
  std::string path;  ///< within the folder of the output: "msg/Door.msg"
  std::string text;
};

/// What a writer made of a model.
struct Written {
  std::vector<TextFile> files{};
  std::vector<NotCarried> not_carried{};
};

}  // namespace trestle::describe
