#include <algorithm>
#include <map>

#include "test/bridge/describe/fidl/fidl_text.hpp"

namespace trestle::describe {
namespace {

TEST(ReadFidl, ComputesConstantsOfEachType) {
  const Reading reading = read({{"K.fidl", R"(package p
    typeCollection T { version { major 1 minor 0 }
      const UInt8 N = 3 * (4 + 5) - 1
      const Double TWO_PI = 2 * 3.25d
      const Double MINUS = -TWO_PI / N
      const Boolean MORE = N > 3 && TWO_PI <= 6.5d
      const Boolean FIRST_AND = true || false && false
      const Boolean NONE = !(N == 26) || MORE != true
      const Boolean WRONG = N && true
      const Double INFINITE = 1.0d / 0.0d
      struct P { UInt8 x Double y }
      const P POINT = { x: 3, y: 1.5d }
      const UInt8 PART = POINT->x
      const P WITH_PART = { x: POINT->x, y: 1.5d }
    } )"}},
                               {"K.fidl"});
  std::map<std::string, std::string> constants;
  for (const Constant& one : reading.model.constants) {
    constants[one.name] = one.value;
  }
  EXPECT_EQ(constants, (std::map<std::string, std::string>{{"N", "26"},
                                                           {"TWO_PI", "6.5"},
                                                           {"MINUS", "-0.25"},
                                                           {"MORE", "true"},
                                                           {"FIRST_AND", "true"},
                                                           {"NONE", "false"},
                                                           {"POINT", "{\"x\": 3, \"y\": 1.5}"},
                                                           {"PART", "3"},
                                                           {"WITH_PART", "{\"x\": 3, \"y\": 1.5}"}}));
  EXPECT_THAT(
      told(reading),
      ElementsAre("K.fidl:9:31: warning: the value of the constant cannot be computed, and is left out",
                  "K.fidl:10:36: warning: the value of the constant cannot be computed, and is left out"));
}

TEST(ReadFidl, FindsAnInheritedEnumeratorByTheNameOfTheDerived) {
  const Reading reading = read({{"A.fidl", R"(package a typeCollection T {
    enumeration E1 { A B C }
    enumeration E2 extends E1 { D = 10 }
    enumeration E3 extends E2 { F = C + 20 }
    const E1 c = E3.C
    const E2 d = E3.D
    const E3 f = E3.F
    const E1 none = E3.X
    const E1 no_type = c.C
    enumeration R1 extends R2 { } enumeration R2 extends R1 { } const R1 r = R1.A })"}},
                               {"A.fidl"});
  std::map<std::string, std::string> values;
  for (const Constant& one : reading.model.constants) {
    values[one.name] = one.value;
  }
  EXPECT_EQ(values["c"], "2");
  EXPECT_EQ(values["d"], "10");
  EXPECT_EQ(values["f"], "22");
  EXPECT_THAT(told(reading), AllOf(Contains(HasSubstr("'E3.X' is not known here")),
                                   Contains(HasSubstr("'c.C' is not known here")),
                                   Contains(HasSubstr("'R1.A' is not known here"))));
}

TEST(ReadFidl, ComputesWithPartsOfConstants) {
  const Reading reading = read({{"A.fidl", R"(package a typeCollection T {
    struct P { UInt8 e1 String e2 Boolean e3 Double e4 }
    struct Q { P p UInt8 e5 }
    const UInt16 x = 123
    const P p = { e1 : 5, e2 : "two", e3 : true, e4 : 0.5d }
    const Q q = { p : p, e5 : x }
    enumeration E { A = p->e1 + x B = q->p->e1 C = q->e5 }
    const String s = p->e2
    const Boolean b = !p->e3
    const Double d = q->p->e4 * 3
    const P copy = q->p
    const UInt8 none = p->e9 })"}},
                               {"A.fidl"});
  std::map<std::string, std::string> values;
  for (const Constant& one : reading.model.constants) {
    values[one.name] = one.value;
  }
  EXPECT_EQ(values["s"], "\"two\"");
  EXPECT_EQ(values["b"], "false");
  EXPECT_EQ(values["d"], "1.5");
  EXPECT_EQ(values["copy"], values["p"]);
  EXPECT_THAT(told(reading), ElementsAre(HasSubstr("warning: the value of the constant cannot be computed")));
  const auto is_e = [](const Type& one) { return one.kind == Kind::enumeration; };
  const auto e = std::ranges::find_if(reading.model.types, is_e);
  ASSERT_NE(e, reading.model.types.end());
  ASSERT_THAT(e->enumerators, SizeIs(3));
  EXPECT_EQ(e->enumerators[0].value, 128);
  EXPECT_EQ(e->enumerators[1].value, 5);
  EXPECT_EQ(e->enumerators[2].value, 123);
}

TEST(ReadFidl, EndsSoonWithPartsOfConstantsThatGoRound) {
  EXPECT_FALSE(told(read({{"A.fidl", R"(package a typeCollection T { struct P { UInt8 a P b }
    const P p = { a : p->a + p->b->a, b : { a : p->a, b : p->b } } })"}},
                         {"A.fidl"}))
                   .empty());
}

TEST(ReadFidl, TellsOfConstantsThatReferToEachOtherInACycle) {
  const Reading reading = read({{"A.fidl", R"(package a typeCollection T {
    const UInt8 a = b
    const UInt8 b = 1 + c
    const UInt8 c = -a
    const UInt8 own = own
    const UInt8 uses = a
    struct P { UInt8 x }
    array Ps of P
    const P p = { x: q->x }
    const P q = { x: 5 }
    const Ps list = [ p, q, r ]
    const P r = { x: last }
    const UInt8 last = 2 * last
    const Boolean no = !no || false
    const Double real = 1.5d * real
    const UInt8 good = 7 })"}},
                               {"A.fidl"});
  EXPECT_FALSE(reading.ok());
  EXPECT_THAT(
      told(reading),
      ElementsAre("A.fidl:4:22: error: the constants form a cycle: 'a' refers to itself, through 'b', 'c'",
                  "A.fidl:5:23: error: the constants form a cycle: 'own' refers to itself",
                  "A.fidl:13:28: error: the constants form a cycle: 'last' refers to itself",
                  "A.fidl:14:25: error: the constants form a cycle: 'no' refers to itself",
                  "A.fidl:15:32: error: the constants form a cycle: 'real' refers to itself"));
  std::vector<std::string> names;
  for (const Constant& one : reading.model.constants) {
    names.push_back(one.name);
  }
  EXPECT_THAT(names, ElementsAre("p", "q", "good"));
}

TEST(ReadFidl, TellsOfConstantsThatItLeavesOut) {
  std::string chain = "package p typeCollection T { const UInt64 c0 = 1\n";
  for (int i = 1; i <= 120; ++i) {
    chain += "const UInt64 c" + std::to_string(i) + " = c" + std::to_string(i - 1) + "\n";
  }
  const Reading reading = read({{"A.fidl", chain + "}"}}, {"A.fidl"});
  EXPECT_THAT(told(reading),
              Contains(HasSubstr("warning: the value of the constant is made of constants more "
                                 "than 100 deep, and is left out")));
}

}  // namespace
}  // namespace trestle::describe
