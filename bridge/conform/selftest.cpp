#include "bridge/conform/selftest.hpp"

#include <algorithm>
#include <array>
#include <cstdio>
#include <memory>
#include <mutex>
#include <set>
#include <sstream>
#include <stdexcept>

#include "bridge/conform/parallel.hpp"

namespace trestle::conform {
namespace {

std::vector<std::string> split(const std::string& text, char at) {
  std::vector<std::string> parts;
  std::istringstream in{text};
  for (std::string part; std::getline(in, part, at);) {
    parts.push_back(part);
  }
  return parts;
}

std::string output_of(const std::string& command) {
  const std::unique_ptr<FILE, int (*)(FILE*)> pipe{::popen(command.c_str(), "r"), ::pclose};
  if (!pipe) {
    throw std::runtime_error{"cannot run '" + command + "'"};
  }
  std::string all;
  std::array<char, 4096> room{};
  while (const std::size_t size = std::fread(room.data(), 1, room.size(), pipe.get())) {
    all.append(room.data(), size);
  }
  return all;
}

bool may_find(const Case& one, const FaultRow& fault) {
  return std::ranges::any_of(fault.finders,
                             [&](const std::string& text) { return conform::chosen(one, text); });
}

/// What is known so far, of all workers.
class Known {
 public:
  [[nodiscard]] bool has_failed(const Case* one) {
    const std::scoped_lock lock{mutex_};
    return failed_.contains(one);
  }
  void failed(const Case* one) {
    const std::scoped_lock lock{mutex_};
    failed_.insert(one);
  }

 private:
  std::mutex mutex_;
  std::set<const Case*> failed_;
};

FaultResult try_fault(const FaultRow& fault, const Profile& profile, const std::vector<const Case*>& cases,
                      const SelftestOptions& options, Known& known) {
  FaultResult result{.fault = fault};
  std::vector<const Case*> finders;
  std::ranges::copy_if(cases, std::back_inserter(finders),
                       [&](const Case* one) { return may_find(*one, fault); });
  // Those first that have not shown yet that they can fail.
  // Not that of std::ranges, whose result Clang 14 does not understand.
  std::stable_partition(finders.begin(), finders.end(),
                        [&](const Case* one) { return !known.has_failed(one); });
  RunOptions how{.folder = options.folder,
                 .programs = options.programs,
                 .fault = fault.name,
                 .seed = options.seed,
                 .keep_evidence = false,
                 .cancelled = options.cancelled,
                 .skip =
                     [&](const Case& one) {
                       return !options.every_pair && !result.found_by.empty() && known.has_failed(&one);
                     },
                 .on_end =
                     [&](const CaseResult& one) {
                       ++result.tried;
                       if (one.outcome.verdict == Verdict::fail) {
                         result.found_by.push_back(one.what->id);
                         known.failed(one.what);
                       } else if (!is_good(one.outcome.verdict)) {
                         result.unjudged.push_back(one.what->id);
                       }
                     }};
  (void)run_cases(profile, finders, how);
  return result;
}

/// On a busy machine a tester stalls, and what it finds then is no failure. What such cases left open is
/// tried again when nothing else goes on: faults that nobody has found, and cases that have not failed.
void try_again(SelftestResult& result, const Profile& profile, const std::vector<const Case*>& cases,
               const SelftestOptions& options, Known& known) {
  for (FaultResult& one : result.faults) {
    const std::vector<std::string> blind = result.blind_cases();
    std::vector<const Case*> open;
    std::ranges::copy_if(cases, std::back_inserter(open), [&](const Case* each) {
      const bool unjudged = std::ranges::find(one.unjudged, each->id) != one.unjudged.end();
      return unjudged && (one.found_by.empty() || std::ranges::find(blind, each->id) != blind.end());
    });
    if (open.empty() || (options.cancelled && options.cancelled())) {
      continue;
    }
    const FaultResult again = try_fault(one.fault, profile, open, options, known);
    one.found_by.insert(one.found_by.end(), again.found_by.begin(), again.found_by.end());
    std::erase_if(one.unjudged, [&](const std::string& id) {
      return std::ranges::find(again.found_by, id) != again.found_by.end();
    });
    if (options.on_fault) {
      options.on_fault(one);
    }
  }
}

}  // namespace

std::vector<FaultRow> read_faults(const std::string& lines) {
  std::vector<FaultRow> all;
  for (const std::string& line : split(lines, '\n')) {
    if (const auto fields = split(line, '\t'); fields.size() == 3) {
      all.push_back({fields[0], split(fields[1], ','), fields[2]});
    }
  }
  return all;
}

std::size_t SelftestResult::found() const {
  return static_cast<std::size_t>(
      std::ranges::count_if(faults, [](const FaultResult& one) { return !one.found_by.empty(); }));
}

std::size_t SelftestResult::passed() const {
  return reference.count(Verdict::pass) + reference.count(Verdict::pass_nonstrict);
}

std::vector<std::string> SelftestResult::blind_cases() const {
  std::set<std::string> failed;
  for (const FaultResult& one : faults) {
    failed.insert(one.found_by.begin(), one.found_by.end());
  }
  std::vector<std::string> blind;
  for (const CaseResult& one : reference.cases) {
    if (is_good(one.outcome.verdict) && !failed.contains(one.what->id)) {
      blind.push_back(one.what->id);
    }
  }
  return blind;
}

SelftestResult selftest(const Profile& profile, const std::vector<const Case*>& chosen,
                        const SelftestOptions& options) {
  if (profile.faults.list.empty()) {
    throw std::runtime_error{profile.file + ": the profile has no 'faults', which a self-test needs"};
  }
  std::vector<FaultRow> faults =
      read_faults(output_of(filled_in(profile.faults.list, profile, options.programs)));
  if (!options.only_faults.empty()) {
    std::erase_if(faults, [&](const FaultRow& one) {
      return std::ranges::find(options.only_faults, one.name) == options.only_faults.end();
    });
  }
  if (faults.empty()) {
    throw std::runtime_error{"'" + profile.faults.list + "' lists no such faults"};
  }
  std::vector<const Case*> cases = chosen;
  if (options.only_finders) {
    std::erase_if(cases, [&](const Case* one) {
      return std::ranges::none_of(faults, [&](const FaultRow& fault) { return may_find(*one, fault); });
    });
  }
  const std::vector<Profile> profiles = neighbours(profile, options.jobs);
  SelftestResult result;
  result.reference = run_side_by_side(profiles, cases,
                                      {.folder = options.folder,
                                       .programs = options.programs,
                                       .seed = options.seed,
                                       .cancelled = options.cancelled,
                                       .on_end = options.on_case});
  // A case that the device does not even pass without a fault finds nothing.
  std::erase_if(cases, [&](const Case* one) {
    return std::ranges::none_of(result.reference.cases, [&](const CaseResult& done) {
      return done.what == one && is_good(done.outcome.verdict);
    });
  });
  result.faults.resize(faults.size());
  Known known;
  std::mutex mutex;
  share_work(static_cast<unsigned>(profiles.size()), faults.size(), [&](unsigned worker, std::size_t index) {
    result.faults[index].fault = faults[index];
    if (options.cancelled && options.cancelled()) {
      return;
    }
    result.faults[index] = try_fault(faults[index], profiles[worker], cases, options, known);
    if (options.on_fault) {
      const std::scoped_lock lock{mutex};
      options.on_fault(result.faults[index]);
    }
  });
  try_again(result, profiles.front(), cases, options, known);
  return result;
}

}  // namespace trestle::conform
