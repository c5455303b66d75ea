#include "bridge/documents/section.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <numeric>

namespace trestle::documents {
namespace {

// A merge can name mappings that merge others, even in circles, so depth and number are limited.
constexpr int merge_depth_max = 8;
constexpr int merge_sources_max = 64;
// Far more than there are keys; keeps the search for duplicates short in a file that is not a configuration.
constexpr std::size_t keys_max = 256;

std::string found(const YAML::Node& node) {
  switch (node.Type()) {
    case YAML::NodeType::Scalar:
      return quote(node.Scalar());
    case YAML::NodeType::Sequence:
      return "a list";
    case YAML::NodeType::Map:
      return "a mapping";
    default:
      return "nothing";
  }
}

}  // namespace

Section::Section(const YAML::Node& node, std::string name, Problems& problems)
    : name_{std::move(name)},
      problems_{problems},
      mark_{to_mark(node.Mark())},
      sources_left_{merge_sources_max} {
  gather(node, nullptr, 0);
}

void Section::gather(const YAML::Node& node, const Mark* merge_mark, int depth) {
  if (!node.IsMap()) {
    problems_.error(merge_mark != nullptr ? *merge_mark : to_mark(node.Mark()),
                    merge_mark != nullptr ? fmt::format("'<<' merges mappings, found {}", found(node))
                                          : fmt::format("{}: expected a mapping (key: value), found {}",
                                                        name_.empty() ? "the file" : name_, found(node)));
    is_mapping_ = false;
    return;
  }
  std::vector<std::pair<YAML::Node, Mark>> merges;
  std::map<std::string, Mark> own;
  std::size_t keys = 0;
  for (const auto& pair : node) {
    const Mark key_mark = to_mark(pair.first.Mark());
    if (!pair.first.IsScalar()) {
      problems_.error(key_mark, fmt::format("expected a key, found {}", found(pair.first)));
      continue;
    }
    const std::string& key = pair.first.Scalar();
    if (++keys > keys_max) {
      problems_.error(key_mark, fmt::format("more than {} keys in one mapping", keys_max));
      break;
    }
    const auto [first, is_new] = own.try_emplace(key, key_mark);
    if (!is_new) {
      problems_.error(key_mark,
                      fmt::format("{} is given twice, first in line {}", quote(key), first->second.line));
    } else if (key == "<<") {
      merges.emplace_back(pair.second, key_mark);
    } else if (find(key) == nullptr) {  // a key of the mapping itself wins over a merged one
      entries_.push_back(
          {key, key_mark, pair.second, merge_mark != nullptr, merge_mark != nullptr ? *merge_mark : Mark{}});
    }
  }
  for (const auto& [sources, mark] : merges) {
    merge(sources, merge_mark != nullptr ? *merge_mark : mark, depth + 1);
  }
}

void Section::merge(const YAML::Node& sources, Mark merge_mark, int depth) {
  const auto merge_one = [&](const YAML::Node& source) {
    if (depth > merge_depth_max || sources_left_-- <= 0) {
      problems_.error(merge_mark, fmt::format("too much is merged here: at most {} mappings, {} deep",
                                              merge_sources_max, merge_depth_max));
      return false;
    }
    gather(source, &merge_mark, depth);
    return true;
  };
  if (!sources.IsSequence()) {
    merge_one(sources);
    return;
  }
  for (const YAML::Node& source : sources) {
    if (!merge_one(source)) {
      return;
    }
  }
}

const Section::Entry* Section::find(std::string_view key) const {
  const auto at = std::ranges::find(entries_, key, &Entry::key);
  return at == entries_.end() ? nullptr : &*at;
}

const Section::Entry* Section::use(const char* key) {
  asked_.emplace_back(key);
  const auto at = std::ranges::find(entries_, key, &Entry::key);
  if (at == entries_.end()) {
    return nullptr;
  }
  at->used = true;
  return &*at;
}

Mark Section::mark_of(const YAML::Node& node, Mark otherwise) {
  const Mark own = node.IsNull() ? Mark{} : to_mark(node.Mark());
  return own.line == 0 ? otherwise : own;
}

Mark Section::value_mark(const char* key) const {
  const Entry* entry = find(key);
  return entry == nullptr ? mark_ : place_of(*entry);
}

Mark Section::key_mark(const char* key) const {
  const Entry* entry = find(key);
  return entry == nullptr ? mark_ : entry->key_mark;
}

Mark Section::use_mark(const char* key) const {
  const Entry* entry = find(key);
  return entry == nullptr ? mark_ : entry->merged ? entry->merge_mark : place_of(*entry);
}

void Section::missing(const char* key, const std::string& expected) {
  if (is_mapping_) {  // otherwise that has been reported already
    problems_.error(mark_, fmt::format("{}'{}' is missing: expected {}", name_.empty() ? "" : name_ + ": ",
                                       key, expected));
  }
}

void Section::unexpected(const char* key, const YAML::Node& node, Mark place, const std::string& expected) {
  problems_.error(place, fmt::format("{}: expected {}, found {}", key, expected, found(node)));
}

bool Section::is_list(const char* key, const Entry& entry) {
  if (!entry.value.IsSequence()) {
    unexpected(key, entry.value, place_of(entry), "a list");
    return false;
  }
  return true;
}

void Section::tell(const char* key, AskedKey::Kind kind, bool required) const {
  if (problems_.listener()) {
    problems_.listener()(mark_, {.name = key, .kind = kind, .required = required});
  }
}

YAML::Node Section::child(const char* key) {
  tell(key, AskedKey::Kind::mapping);
  const Entry* entry = use(key);
  if (entry == nullptr) {
    return YAML::Node{YAML::NodeType::Undefined};
  }
  if (!entry->value.IsMap()) {
    unexpected(key, entry->value, place_of(*entry), "a mapping (key: value)");
    return YAML::Node{YAML::NodeType::Undefined};
  }
  return entry->value;
}

std::vector<YAML::Node> Section::required_list(const char* key, const std::string& expected) {
  tell(key, AskedKey::Kind::mappings, true);
  if (use(key) == nullptr) {
    missing(key, expected);
    return {};
  }
  return list(key, expected);
}

std::vector<YAML::Node> Section::list(const char* key, const std::string& expected) {
  tell(key, AskedKey::Kind::mappings);
  const Entry* entry = use(key);
  if (entry == nullptr) {
    return {};
  }
  if (!entry->value.IsSequence() || entry->value.size() == 0) {
    problems_.error(place_of(*entry),
                    fmt::format("{}: expected {}, found {}", key, expected,
                                entry->value.IsSequence() ? "an empty list" : found(entry->value)));
    return {};
  }
  std::vector<YAML::Node> elements;
  for (std::size_t i = 0; i < entry->value.size(); ++i) {
    // An empty element has no place of its own.
    if (elements.emplace_back(entry->value[i]).IsNull()) {
      problems_.error(place_of(*entry), fmt::format("{}: element {} is empty", key, i + 1));
      elements.pop_back();
    }
  }
  return elements;
}

std::vector<std::string> Section::keys() const {
  tell("", AskedKey::Kind::any_name);
  std::vector<std::string> keys;
  for (const Entry& entry : entries_) {
    keys.push_back(entry.key);
  }
  return keys;
}

void Section::finish() {
  // Some were asked for more than once.
  std::vector<std::string> known;
  for (const std::string& key : asked_) {
    if (std::ranges::find(known, key) == known.end()) {
      known.push_back(key);
    }
  }
  for (const Entry& entry : entries_) {
    if (entry.used) {
      continue;
    }
    const std::string likely = nearest(entry.key, known);
    const std::string hint = likely.empty() ? fmt::format("known here: {}", fmt::join(known, ", "))
                                            : fmt::format("did you mean '{}'?", likely);
    problems_.error(entry.key_mark, fmt::format("unknown key {}{}; {}", quote(entry.key),
                                                name_.empty() ? "" : " in " + name_, hint));
  }
}

std::string nearest(std::string_view word, const std::vector<std::string>& words) {
  if (word.size() > 40) {
    return {};
  }
  std::string best;
  std::size_t best_distance = std::max<std::size_t>(1, word.size() / 3) + 1;
  for (const std::string& candidate : words) {
    // Edit distance (Levenshtein), one row at a time.
    std::vector<std::size_t> row(candidate.size() + 1);
    std::iota(row.begin(), row.end(), std::size_t{0});
    for (std::size_t i = 0; i < word.size(); ++i) {
      std::size_t diagonal = row[0];
      row[0] = i + 1;
      for (std::size_t j = 0; j < candidate.size(); ++j) {
        const std::size_t replaced = diagonal + (word[i] == candidate[j] ? 0 : 1);
        diagonal = row[j + 1];
        row[j + 1] = std::min({replaced, row[j] + 1, row[j + 1] + 1});
      }
    }
    if (row.back() < best_distance) {
      best_distance = row.back();
      best = candidate;
    }
  }
  return best;
}

}  // namespace trestle::documents
