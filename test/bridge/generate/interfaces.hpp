#pragma once
#include <fstream>
#include <map>
#include <sstream>
#include <string>
#include <vector>

#include "bridge/describe/read/source_text.hpp"
#include "test/source_dir.hpp"

namespace trestle::generate {

/// FIDL and its deployments, of interfaces.txt.
struct Interface {
  std::string name;
  std::string version;
  std::string fidl;
  std::map<std::string, std::string> deployed;  ///< by what for
};

/// Those of interfaces.txt, which have every key together.
inline std::vector<Interface> interfaces() {
  std::vector<Interface> all;
  std::ifstream in{test::source_dir() + "/test/bridge/generate/interfaces.txt"};
  std::string* into = nullptr;
  for (std::string line; std::getline(in, line);) {
    if (line.starts_with("== ")) {
      std::istringstream words{line.substr(3)};
      Interface& one = all.emplace_back();
      words >> one.name >> one.version;
      into = &one.fidl;
    } else if (line.starts_with("-- ")) {
      into = &all.back().deployed[line.substr(3)];
    } else if (into != nullptr) {
      *into += line + "\n";
    }
  }
  return all;
}

/// As files: Car.fidl and Car.fdepl.
inline std::vector<describe::SourceText> texts_of(const Interface& one) {
  const std::string specification = one.version == "1" ? "CommonAPI-SOMEIP" : "CommonAPI-4-SOMEIP";
  const auto deployed = [&](const char* what) {
    const auto found = one.deployed.find(what);
    return found == one.deployed.end() ? std::string{} : found->second;
  };
  const std::string define = "define org.genivi.commonapi.someip.deployment for ";
  return {
      {"Car.fidl", "package car\ninterface Car {\nversion { major 1 minor 2 }\n" + one.fidl + "}\n"},
      {"Car.fdepl", "import \"platform:/plugin/org.genivi.commonapi.someip/deployment/" + specification +
                        "_deployment_spec.fdepl\"\nimport \"Car.fidl\"\n" + define + "interface car.Car {\n" +
                        deployed("interface") + "}\n" + define + "provider as Cars {\n" +
                        deployed("provider") + "instance car.Car {\n" + deployed("instance") + "}\n}\n"}};
}

}  // namespace trestle::generate
