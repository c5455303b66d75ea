#include "bridge/describe/fidl_words.hpp"

#include <algorithm>

namespace trestle::describe {
namespace {

std::vector<std::string> sorted(std::vector<std::string> words) {
  std::ranges::sort(words);
  return words;
}

}  // namespace

const std::vector<std::string>& fidl_keywords() {
  static const std::vector<std::string> words = sorted({"Boolean",
                                                        "ByteBuffer",
                                                        "Double",
                                                        "Float",
                                                        "Int16",
                                                        "Int32",
                                                        "Int64",
                                                        "Int8",
                                                        "Integer",
                                                        "PSM",
                                                        "String",
                                                        "UInt16",
                                                        "UInt32",
                                                        "UInt64",
                                                        "UInt8",
                                                        "array",
                                                        "attribute",
                                                        "broadcast",
                                                        "call",
                                                        "const",
                                                        "contract",
                                                        "else",
                                                        "enumeration",
                                                        "error",
                                                        "extends",
                                                        "false",
                                                        "fireAndForget",
                                                        "from",
                                                        "if",
                                                        "import",
                                                        "in",
                                                        "initial",
                                                        "interface",
                                                        "is",
                                                        "major",
                                                        "manages",
                                                        "map",
                                                        "maxInt",
                                                        "method",
                                                        "minInt",
                                                        "minor",
                                                        "model",
                                                        "noRead",
                                                        "noSubscriptions",
                                                        "of",
                                                        "on",
                                                        "out",
                                                        "package",
                                                        "polymorphic",
                                                        "public",
                                                        "readonly",
                                                        "respond",
                                                        "selective",
                                                        "set",
                                                        "signal",
                                                        "state",
                                                        "struct",
                                                        "to",
                                                        "true",
                                                        "typeCollection",
                                                        "typedef",
                                                        "undefined",
                                                        "union",
                                                        "update",
                                                        "vars",
                                                        "version"});
  return words;
}

const std::vector<std::string>& fdepl_keywords() {
  static const std::vector<std::string> words =
      sorted({"Boolean",   "Integer",        "Interface", "String",      "array",         "as",
              "attribute", "broadcast",      "define",    "enumeration", "extends",       "false",
              "for",       "import",         "in",        "interface",   "key",           "map",
              "method",    "optional",       "out",       "package",     "specification", "struct",
              "true",      "typeCollection", "typedef",   "union",       "use",           "value"});
  return words;
}

}  // namespace trestle::describe
