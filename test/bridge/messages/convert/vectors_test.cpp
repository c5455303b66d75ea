// All built-in types and some of every kind of field, against the vectors of test/bridge/oracle/oracle.py.
#include <fstream>
#include <map>
#include <sstream>

#include "test/bridge/messages/convert/cdr_walk.hpp"
#include "test/bridge/messages/convert/profiles.hpp"
#include "test/bridge/messages/convert/support.hpp"
#include "test/source_dir.hpp"

namespace trestle::messages::vectors_test {
namespace {

using namespace trestle::test;
struct Vector {
  std::string type;
  std::string profile;
  std::vector<std::byte> little;
  std::vector<std::byte> big;
  std::vector<std::byte> payload;
};

const std::vector<Vector>& vectors() {
  static const std::vector<Vector> all = [] {
    std::vector<Vector> result;
    // Those that stand in the repository, and others made while building.
    for (const std::string& file :
         {test::source_dir() + "/test/bridge/oracle/vectors.txt", std::string{TRESTLE_FRESH_VECTORS}}) {
      std::ifstream in{file};
      for (std::string line; std::getline(in, line);) {
        std::istringstream words{line};
        Vector vector;
        std::string little;
        std::string big;
        std::string payload;
        words >> vector.type >> vector.profile >> little >> big >> payload;
        vector.little = hex(little);
        vector.big = hex(big);
        vector.payload = hex(payload);
        result.push_back(std::move(vector));
      }
    }
    return result;
  }();
  return all;
}

TypeLibrary library() {
  return TypeLibrary{{test::source_dir() + "/test/bridge/oracle/msgs"}};
}

/// Calls `check` with each vector and its plan, and names it when the check fails.
template <typename Check>
void for_each_vector(std::size_t reference_from, const Check& check,
                     ConversionPlan::Execution execution = ConversionPlan::Execution::quick) {
  TypeLibrary types = library();
  std::map<std::pair<std::string, std::string>, ConversionPlan> plans;
  ASSERT_GE(vectors().size(), 2 * 99U);
  for (const Vector& vector : vectors()) {
    SCOPED_TRACE(vector.type + " " + vector.profile + " " + to_hex(vector.little));
    auto known = plans.find({vector.type, vector.profile});
    if (known == plans.end()) {
      const auto tree = types.resolve(vector.type);
      ASSERT_TRUE(tree) << to_string(tree.error());
      known = plans
                  .emplace(std::pair{vector.type, vector.profile},
                           plan_with(*tree, message_rules(vector.profile, *tree), reference_from, execution))
                  .first;
    }
    check(vector, known->second);
    if (testing::Test::HasFailure()) {
      return;  // one is enough to read
    }
  }
}

TEST(Vectors, HaveEveryBuiltInType) {
  std::map<std::string, int> seen;
  for (const Vector& vector : vectors()) {
    ++seen[vector.type];
  }
  for (const auto& name : TypeLibrary::builtin_names()) {
    if (name.find("/msg/") != std::string::npos) {
      EXPECT_GE(seen[name], 2) << name;
    }
  }
}

TEST(Vectors, ConvertBothWaysFromBothByteOrders) {
  const auto check = [](const Vector& vector, const ConversionPlan& plan) {
    EXPECT_EQ(to_someip(plan, vector.little), to_hex(vector.payload));
    EXPECT_EQ(to_someip(plan, vector.big), to_hex(vector.payload));
    EXPECT_EQ(to_cdr(plan, vector.payload), to_hex(vector.little));
  };
  for (const auto execution : {ConversionPlan::Execution::quick, ConversionPlan::Execution::plain}) {
    for (const std::size_t reference_from : {std::size_t{1}, std::size_t{16}, SIZE_MAX}) {
      for_each_vector(reference_from, check, execution);
    }
  }
}

TEST(Vectors, AgreeWithFastCdr) {
  TypeLibrary types = library();
  for (const Vector& vector : vectors()) {
    const auto tree = types.resolve(vector.type);
    ASSERT_TRUE(tree);
    EXPECT_EQ(to_hex(rewritten_by_fastcdr(*tree, vector.little, std::endian::big)), to_hex(vector.big))
        << vector.type;
    EXPECT_EQ(to_hex(rewritten_by_fastcdr(*tree, vector.big, std::endian::little)), to_hex(vector.little))
        << vector.type;
  }
}

TEST(Vectors, AgreeWithThePayloadWriter) {
  TypeLibrary types = library();
  for (const Vector& vector : vectors()) {
    const auto tree = types.resolve(vector.type);
    ASSERT_TRUE(tree);
    if (!has_wstring(*tree) && vector.profile != "by_field") {
      EXPECT_EQ(to_hex(written_by_payload_writer(*tree, vector.little, profile(vector.profile))),
                to_hex(vector.payload))
          << vector.type << " " << vector.profile;
    }
  }
}

TEST(Vectors, AnyTruncatedSampleIsRefused) {
  for_each_vector(64, [](const Vector& vector, const ConversionPlan& plan) {
    ConversionScratch scratch;
    for (std::size_t size = 0; size < vector.little.size(); ++size) {
      const std::vector<std::byte> cut{vector.little.begin(),
                                       vector.little.begin() + static_cast<std::ptrdiff_t>(size)};
      const auto result = plan.cdr_to_someip(cut, scratch);
      ASSERT_FALSE(result) << "accepted when cut to " << size;
      ASSERT_EQ(result.error().fault, ConversionFault::truncated) << to_string(result.error());
      // The padding in front of the item at fault may be missing too.
      ASSERT_LE(result.error().offset, size + 7) << to_string(result.error());
    }
  });
}

TEST(Vectors, AnyTruncatedPayloadIsRefused) {
  for_each_vector(64, [](const Vector& vector, const ConversionPlan& plan) {
    ConversionScratch scratch;
    for (std::size_t size = 0; size < vector.payload.size(); ++size) {
      const std::vector<std::byte> cut{vector.payload.begin(),
                                       vector.payload.begin() + static_cast<std::ptrdiff_t>(size)};
      const auto result = plan.someip_to_cdr(cut, scratch);
      if (result) {
        // Only the padding at the end may be missing, where nothing counts it.
        ASSERT_GT(plan.program().rules.alignment, 1) << "accepted when cut to " << size;
        ASSERT_EQ(joined(*result), vector.little) << "another message when cut to " << size;
      } else {
        ASSERT_EQ(result.error().fault, ConversionFault::truncated) << to_string(result.error());
        ASSERT_LE(result.error().offset, size);
      }
    }
  });
}

/// Whatever one changed byte does: nothing is read out of bounds, and what is accepted converts back to an
/// equal message.
TEST(Vectors, AnyDamagedByteGivesAnErrorOrAnotherMessage) {
  for_each_vector(64, [](const Vector& vector, const ConversionPlan& plan) {
    ConversionScratch scratch;
    ConversionScratch back;
    ConversionScratch again;
    if (vector.payload.size() > 100) {
      return;  // damage costs the square of the size; the fuzzers do the rest
    }
    for (std::size_t at = 0; at < vector.payload.size(); ++at) {
      for (const unsigned change : {0x01U, 0x80U, 0xffU}) {
        auto damaged = vector.payload;
        damaged[at] ^= static_cast<std::byte>(change);
        const auto cdr = plan.someip_to_cdr(damaged, scratch);
        if (!cdr) {
          continue;
        }
        const auto first = joined(*cdr);
        const auto payload = plan.cdr_to_someip(first, back);
        ASSERT_TRUE(payload) << "byte " << at << ": " << to_string(payload.error());
        const auto between = joined(*payload);
        const auto second = plan.someip_to_cdr(between, again);
        ASSERT_TRUE(second) << to_string(second.error());
        const auto last = joined(*second);
        ASSERT_TRUE(last == first) << "byte " << at << ": " << to_hex(first) << ", then " << to_hex(last);
      }
    }
    for (std::size_t at = 0; at < vector.big.size(); ++at) {
      for (const unsigned change : {0x01U, 0x80U, 0xffU}) {
        auto damaged = vector.big;
        damaged[at] ^= static_cast<std::byte>(change);
        const auto payload = plan.cdr_to_someip(damaged, scratch);
        if (payload) {
          const auto first = joined(*payload);
          const auto cdr = plan.someip_to_cdr(first, back);
          ASSERT_TRUE(cdr) << "byte " << at << ": " << to_string(cdr.error());
          const auto between = joined(*cdr);
          const auto second = plan.cdr_to_someip(between, again);
          ASSERT_TRUE(second) << to_string(second.error());
          const auto last = joined(*second);
          ASSERT_TRUE(last == first) << "byte " << at << ": " << to_hex(first) << ", then " << to_hex(last);
        }
      }
    }
  });
}

}  // namespace
}  // namespace trestle::messages::vectors_test
