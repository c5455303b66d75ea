#include "bridge/describe/read/fidl/read_fidl.hpp"

#include "bridge/describe/read/fidl/services.hpp"

namespace trestle::describe {

Reading read_fidl(std::span<const SourceText> files, const Load& load) {
  Problems findings{max_problems};
  Reading reading;
  const fidl::Sources sources = fidl::load_sources(files, load, findings);
  fidl::Names names{sources, findings};
  fidl::Types types{reading.model, names, findings};
  types.make_all();
  fidl::make_services(reading.model, names, types, findings);
  reading.model.files = sources.names;
  reading.problems = findings.take(sources.names);
  return reading;
}

}  // namespace trestle::describe
