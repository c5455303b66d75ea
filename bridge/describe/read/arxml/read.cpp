#include "bridge/describe/read/arxml/adaptive.hpp"
#include "bridge/describe/read/arxml/arxml.hpp"
#include "bridge/describe/read/arxml/classic.hpp"

namespace trestle::describe {

Reading read_arxml(std::span<ArxmlInput> inputs, const ArxmlOptions& options) {
  Reading reading;
  Model& model = reading.model;
  for (const ArxmlInput& input : inputs) {
    model.files.push_back(input.name);
  }
  documents::Problems problems{max_problems};
  constexpr std::size_t max_files = 0xffff;
  if (inputs.size() > max_files) {
    problems.error(Place{}, "there are more than 65535 files");
  } else {
    arxml::Tree tree{options, model, problems};
    bool complete = true;
    for (std::size_t file = 0; file < inputs.size(); ++file) {
      complete = tree.add(inputs[file].stream, static_cast<std::uint16_t>(file)) && complete;
    }
    // References to what is in a file that cannot be read would be wrong as well.
    if (complete) {
      tree.join();
      Copies copies{problems, options.max_copies};
      arxml::Contexts contexts{tree, problems};
      arxml::Types types{tree, problems, contexts, copies, options, model};
      arxml::Adaptive{tree, problems, contexts, copies, types, options, model}.read();
      arxml::Classic{tree, problems, copies, types, contexts, model}.read();
      types.read_all();
      if (contexts.has_tags({})) {
        arxml::find_tagged_lengths(model, problems);
      }
    }
  }
  reading.problems = problems.take(model.files);
  return reading;
}

}  // namespace trestle::describe
