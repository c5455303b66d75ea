// What tests of the FIDL reader share.
#pragma once
#include <gmock/gmock.h>

#include <map>
#include <string>
#include <vector>

#include "bridge/describe/read/fidl/read_fidl.hpp"

namespace trestle::describe {

using ::testing::AllOf;
using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;

using Files = std::map<std::string, std::string>;

inline Reading read(const Files& files, std::vector<std::string> named, const FidlLimits& limits = {}) {
  std::vector<SourceText> sources;
  for (const std::string& name : named) {
    sources.push_back({name, files.at(name)});
  }
  const Load load = [&](const std::string& name) -> tl::expected<std::string, std::string> {
    const auto found = files.find(name);
    if (found == files.end()) {
      return tl::unexpected{std::string{"there is no such file"}};
    }
    return found->second;
  };
  return read_fidl(sources, load, limits);
}

inline std::vector<std::string> told(const Reading& reading) {
  std::vector<std::string> all;
  for (const documents::Problem& problem : reading.problems) {
    all.push_back(documents::to_string(problem));
  }
  return all;
}

inline constexpr const char* v2 =
    "import "
    "\"platform:/plugin/org.genivi.commonapi.someip/deployment/CommonAPI-4-SOMEIP_deployment_spec.fdepl\"\n";
inline constexpr const char* v1 =
    "import "
    "\"platform:/plugin/org.genivi.commonapi.someip/deployment/CommonAPI-SOMEIP_deployment_spec.fdepl\"\n";
inline constexpr const char* spec = "define org.genivi.commonapi.someip.deployment for ";

/// An interface a.b.I of version 1.2 and its deployment.
inline Reading deployed(const std::string& members, const std::string& deployment, const char* version = v2,
                        const std::string& more = "") {
  return read(
      {{"I.fidl", "package a.b\ninterface I {\nversion { major 1 minor 2 }\n" + members + "\n}\n"},
       {"I.fdepl", version + std::string{"import \"I.fidl\"\n"} + spec +
                       "interface a.b.I {\nSomeIpServiceID = 0x1234\n" + deployment + "\n}\n" + more}},
      {"I.fdepl"});
}

inline const Value& only_value(const Reading& reading) {
  return reading.model.services.at(0).fields.at(0).payload.values.at(0);
}

}  // namespace trestle::describe
