// arxml_counts [--json | --canonical | --arxml] FILE...: reads the files together and prints what is in them,
// for tests in Python: as numbers, as JSON, or as ARXML again, with what that does not carry on standard
// error.
#include <deque>
#include <fstream>
#include <iostream>
#include <string_view>
#include <vector>

#include "bridge/describe/model_json.hpp"
#include "bridge/describe/read/arxml/arxml.hpp"
#include "bridge/describe/write/arxml/write_arxml.hpp"

int main(int argc, char** argv) {
  using namespace trestle;
  std::vector<std::string_view> names{argv + 1, argv + argc};
  const bool json = !names.empty() && names.front() == "--json";
  const bool again = !names.empty() && names.front() == "--arxml";
  const bool canonical = !names.empty() && names.front() == "--canonical";
  if (json || again || canonical) {
    names.erase(names.begin());
  }
  std::deque<std::ifstream> streams;
  std::vector<describe::ArxmlInput> inputs;
  for (const std::string_view name : names) {
    streams.emplace_back(std::string{name}, std::ios::binary);
    inputs.push_back({std::string{name}, streams.back()});
  }
  const describe::Reading reading = describe::read_arxml(inputs);
  for (const documents::Problem& problem : reading.problems) {
    std::cerr << documents::to_string(problem) << '\n';
  }
  const describe::Model& model = reading.model;
  if (again) {
    const describe::ArxmlFile file = describe::write_arxml(model);
    std::cout << file.text;
    for (const describe::NotCarried& lost : file.not_carried) {
      std::cerr << "not carried: " << lost.element << ": " << lost.what << '\n';
    }
    return reading.ok() ? 0 : 1;
  }
  if (canonical) {
    std::cout << describe::canonical(model);
    return reading.ok() ? 0 : 1;
  }
  if (json) {
    std::cout << describe::to_json_text(model, false);
    return reading.ok() ? 0 : 1;
  }
  std::size_t methods = 0;
  std::size_t events = 0;
  std::size_t fields = 0;
  for (const describe::Service& service : model.services) {
    methods += service.methods.size();
    events += service.events.size();
    fields += service.fields.size();
  }
  std::size_t types = 0;
  for (const describe::Type& type : model.types) {
    types += !type.name.empty() && type.variant_of == describe::no_type ? 1U : 0U;
  }
  std::cout << "services " << model.services.size() << "\nmethods " << methods << "\nevents " << events
            << "\nfields " << fields << "\ninstances " << model.instances.size() << "\nmachines "
            << model.machines.size() << "\ntypes " << types << '\n';
  return reading.ok() ? 0 : 1;
}
