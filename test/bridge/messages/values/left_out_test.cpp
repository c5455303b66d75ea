#include "bridge/messages/values/left_out.hpp"

#include "test/bridge/messages/values/support.hpp"

namespace trestle::test {
namespace {

using messages::FieldWords;
using messages::MessageValues;
using messages::MessageWords;
using messages::ValueForm;
using messages::Words;
using testing::ElementsAre;
using testing::IsEmpty;

TEST(LeftOut, IsWhatATextDoesNotMention) {
  const MessageValues values = values_of(nested_tree("uint8 x\n", "uint8 a\nint16 b\nPart c\n"));
  EXPECT_THAT(left_out(values, "{a: 1}", ValueForm::yaml), ElementsAre("b", "c"));
  EXPECT_THAT(left_out(values, R"({"c": {}})", ValueForm::json), ElementsAre("a", "b"));
  EXPECT_THAT(left_out(values, "", ValueForm::yaml), ElementsAre("a", "b", "c"));
  EXPECT_THAT(left_out(values, "{a: 1, b: 2, c: {}}", ValueForm::yaml), IsEmpty());
}

TEST(LeftOut, HasTheNamesOfADescription) {
  const messages::TypeTree tree = nested_tree("uint8 x\n", "uint8 a\nint16[<=1] b\n");
  const auto with = [&](Words words) {
    words.messages = {{}, {.fields = {{.name = "Axis"}, {.form = FieldWords::Form::optional, .name = "B"}}}};
    return *MessageValues::make(tree, {}, std::move(words));
  };
  EXPECT_THAT(left_out(with({}), "{}", ValueForm::yaml), ElementsAre("Axis")) << "the other may be missing";
  const MessageValues of_argument = with({.argument = "position"});
  EXPECT_THAT(left_out(of_argument, "{position: {}}", ValueForm::yaml), ElementsAre("Axis"));
  EXPECT_THAT(left_out(of_argument, "{Axis: 1}", ValueForm::yaml), IsEmpty());
}

}  // namespace
}  // namespace trestle::test
