#include "bridge/describe/read/fidl/read_fidl.hpp"

#include <fmt/format.h>

#include <limits>
#include <map>

#include "bridge/describe/read/fidl/services.hpp"

namespace trestle::describe {
namespace {

/// What type collections say of themselves. Several of one scope, as those without names of a package, are
/// one.
void add_collections(Model& model, fidl::Names& names, Problems& findings) {
  std::map<std::string, std::size_t> places;
  for (const fidl::Collection& from : names.collections()) {
    const fidl::CollectionTree& tree = *from.scope.in;
    if (tree.is_interface) {
      continue;
    }
    TypeCollection collection{.scope = from.scope.model, .notes = tree.notes, .place = tree.name.place};
    constexpr std::int64_t most = std::numeric_limits<std::uint32_t>::max();
    if (tree.major < 0 || tree.major > most || tree.minor < 0 || tree.minor > most) {
      findings.warning(tree.name.place,
                       "the version of a type collection has more than 32 bits; 1.0 is taken");
    } else {
      collection.major = static_cast<std::uint32_t>(tree.major);
      collection.minor = static_cast<std::uint32_t>(tree.minor);
    }
    if (collection.major == 1 && collection.minor == 0 && collection.notes == Notes{}) {
      continue;
    }
    const auto [place, is_new] = places.try_emplace(collection.scope, model.collections.size());
    if (is_new) {
      model.collections.push_back(std::move(collection));
      continue;
    }
    TypeCollection& first = model.collections[place->second];
    if (first.major != collection.major || first.minor != collection.minor) {
      findings.warning(tree.name.place,
                       fmt::format("a type collection of the same name has version {}.{}, which is taken",
                                   first.major, first.minor));
    }
    if (!collection.notes.description.empty()) {
      first.notes.description += (first.notes.description.empty() ? "" : "\n") + collection.notes.description;
    }
    first.notes.others.merge(collection.notes.others);
  }
}

}  // namespace

Reading read_fidl(std::span<const SourceText> files, const Load& load, const FidlLimits& limits) {
  Problems findings{max_problems};
  Reading reading;
  const fidl::Sources sources = fidl::load_sources(files, load, limits, findings);
  if (sources.too_much) {
    reading.model.files = sources.names;
    reading.problems = findings.take(sources.names);
    return reading;
  }
  reading.model.files = sources.names;
  fidl::Names names{sources, findings};
  reading.model.files = sources.names;
  fidl::Types types{reading.model, names, findings, limits.copies};
  types.make_all();
  add_collections(reading.model, names, findings);
  fidl::make_services(reading.model, names, types, findings);
  reading.problems = findings.take(sources.names);
  return reading;
}

}  // namespace trestle::describe
