#pragma once
#include <cstdint>
#include <cstdio>
#include <mutex>
#include <stdexcept>
#include <string>
#include <vector>

#include "someip/wire/types.hpp"

/// What the ends of hostile_flow have in common.
namespace trestle::test {

inline constexpr someip::MethodId the_event{0x8001};
inline constexpr someip::EventgroupId the_eventgroup{1};

/// Lines of standard output, by several threads. They are in memory until flush(): a system call for each
/// message would be a burden of the test's own.
class Lines {
 public:
  void add(const std::string& line) {
    const std::lock_guard lock{mutex_};
    text_ += line;
    text_ += '\n';
  }
  void flush() {
    std::string text;
    {
      const std::lock_guard lock{mutex_};
      text.swap(text_);
    }
    std::fwrite(text.data(), 1, text.size(), stdout);
    std::fflush(stdout);
  }

 private:
  std::mutex mutex_;
  std::string text_;
};

/// FLOW=KIND:WORD:...
struct Part {
  std::string flow;
  std::vector<std::string> words;

  explicit Part(const std::string& text) : flow{text.substr(0, text.find('='))} {
    for (std::size_t at = flow.size() + 1; at <= text.size();) {
      const std::size_t end = std::min(text.find(':', at), text.size());
      words.push_back(text.substr(at, end - at));
      at = end + 1;
    }
  }
  [[nodiscard]] const std::string& word(std::size_t i) const {
    if (i >= words.size()) {
      throw std::invalid_argument{flow + ": word " + std::to_string(i) + " is missing"};
    }
    return words[i];
  }
  [[nodiscard]] std::string word(std::size_t i, const char* otherwise) const {
    return i < words.size() ? words[i] : otherwise;
  }
  [[nodiscard]] double number(std::size_t i) const { return std::stod(word(i)); }
  [[nodiscard]] std::uint16_t id(std::size_t i) const {
    return static_cast<std::uint16_t>(std::stoul(word(i), nullptr, 0));
  }
};

}  // namespace trestle::test
