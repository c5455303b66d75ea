#include "bridge/generate/page.hpp"

#include <gmock/gmock.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>

#include "bridge/generate/page_server.hpp"

namespace trestle::generate {
namespace {

using nlohmann::json;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Not;
using ::testing::SizeIs;

constexpr const char* lamp = R"(package car
interface Lamp {
  version { major 2 minor 1 }
  method dim { in { Level level UInt16[] steps } out { Boolean done } error Fault }
  method dim:fast { in { UInt8 level } out { Boolean done } }
  method flash fireAndForget { in { Colour colour } }
  broadcast burnt { out { String who } }
  attribute Level level
  enumeration Level { LOW = 1 HIGH = 7 }
  enumeration Fault { OK BROKEN }
  struct Colour { UInt8 red Float warmth }
}
)";

/// A question about the lamp.
json question(json more = json::object()) {
  json all{{"files", json::array({{{"name", "Lamp.fidl"}, {"text", lamp}}})}, {"edits", json::object()}};
  all.update(more);
  return all;
}

json about(const std::string& kind, const std::string& member, json more = json::object()) {
  json all{{"service", "car.Lamp"}, {"kind", kind}, {"member", member}};
  all.update(more);
  return question(all);
}

class PageTest : public ::testing::Test {
 protected:
  [[nodiscard]] static web::Request post(const std::string& path, const json& body) {
    return {.method = "POST", .path = path, .body = body.dump()};
  }
  json ask(const std::string& path, const json& body) {
    const web::Answer answer = page_.answer(post(path, body));
    EXPECT_EQ(answer.status, 200U) << answer.body;
    return json::parse(answer.body);
  }

  Page page_{{.files = {{"Start.fidl", "package a"}}}};
};

TEST_F(PageTest, BeginsWithTheFilesThatTheProgramWasStartedWith) {
  const json start = json::parse(page_.answer({.method = "GET", .path = "/api/start"}).body);
  EXPECT_EQ(start["files"][0]["name"], "Start.fidl");
  EXPECT_EQ(start["files"][0]["text"], "package a");
}

TEST_F(PageTest, GivesTheModelWithTheIdsThatAreWanted) {
  const json system = ask("/api/system", question({{"edits",
                                                    {{"car.Lamp",
                                                      {{"id", "0x1234"},
                                                       {"instance", "7"},
                                                       {"methods", {{"dim:fast", {{"id", "0x0042"}}}}},
                                                       {"events", {{"burnt", {{"id", "0x8123"}}}}},
                                                       {"fields", {{"level", {{"setter", "0x0077"}}}}}}}}}}));
  EXPECT_TRUE(system["good"]);
  const json& service = system["model"]["services"][0];
  EXPECT_EQ(service["id"], "0x1234");
  EXPECT_EQ(service["instances"][0]["id"], "0x0007");
  EXPECT_EQ(service["methods"][1]["id"], "0x0042");
  EXPECT_NE(service["methods"][0]["id"], "0x0042");  // of the same name
  EXPECT_EQ(service["events"][0]["id"], "0x8123");
  EXPECT_EQ(service["fields"][0]["setter"], "0x0077");
  EXPECT_THAT(system["targets"], SizeIs(targets().size()));
  EXPECT_THAT(system["lock"].get<std::string>(), HasSubstr("car.Lamp"));
}

TEST_F(PageTest, EditsNamesVersionsTransportsAndEventgroups) {
  const json edits{
      {"car.Lamp",
       {{"name", "Light"},
        {"major", "9"},
        {"minor", "4"},
        {"udp_port", "30509"},
        {"tcp_port", "30510"},
        {"methods", {{"dim:fast", {{"name", "fade"}, {"transport", "tcp"}}}}},
        {"events", {{"burnt", {{"name", "dead"}, {"eventgroups", {"0x0007", "5"}}}}}},
        {"fields", {{"level", {{"name", "height"}, {"transport", "tcp"}, {"eventgroups", {"7"}}}}}}}}};
  const json system = ask("/api/system", question({{"edits", edits}}));
  EXPECT_TRUE(system["good"]) << system["problems"];
  const json& service = system["model"]["services"][0];
  EXPECT_EQ(service["name"], "Light");
  EXPECT_EQ(service["major"], 9);
  EXPECT_EQ(service["minor"], 4);
  EXPECT_EQ(service["instances"][0]["udp_port"], 30509);
  EXPECT_EQ(service["instances"][0]["tcp_port"], 30510);
  EXPECT_EQ(service["methods"][1]["name"], "fade");
  EXPECT_EQ(service["methods"][1]["selector"], "fast");
  EXPECT_EQ(service["methods"][1]["request_transport"], "tcp");
  EXPECT_EQ(service["methods"][0]["request_transport"], "udp");
  EXPECT_EQ(service["events"][0]["name"], "dead");
  EXPECT_EQ(service["events"][0]["eventgroups"], json::parse(R"(["0x0007", "0x0005"])"));
  EXPECT_EQ(service["fields"][0]["name"], "height");
  EXPECT_EQ(service["fields"][0]["notifier_transport"], "tcp");
  EXPECT_EQ(service["eventgroups"][1]["events"], json::parse(R"(["dead", "height"])"));
  EXPECT_EQ(system["renamed"], json({{"car.Light", "car.Lamp"},
                                     {"car.Light methods fade:fast", "dim:fast"},
                                     {"car.Light events dead", "burnt"},
                                     {"car.Light fields height", "level"}}));
  // Questions have the names of now.
  json asked = about("fields", "height", {{"edits", edits}, {"access", "getter"}});
  asked["service"] = "car.Light";
  const auto call = page_.call(post("/api/call", asked));
  ASSERT_TRUE(call) << call.error().body;
  EXPECT_EQ(call->service.major, 9);
  EXPECT_EQ(call->call.transport, Transport::tcp);
  const json routes = ask("/api/preview", question({{"edits", edits}, {"target", "routes"}}));
  EXPECT_THAT(routes["files"][0]["text"].get<std::string>(), HasSubstr("/light/dead"));
}

TEST_F(PageTest, RefusesNamesThatAreTaken) {
  const auto problem = [&](const json& edit) {
    const json system = ask("/api/system", question({{"edits", {{"car.Lamp", edit}}}}));
    EXPECT_FALSE(system["good"]);
    EXPECT_EQ(system["renamed"], json::object());
    return system["problems"][0]["text"].get<std::string>();
  };
  EXPECT_THAT(problem({{"methods", {{"dim", {{"name", "flash"}}}}}}),
              HasSubstr("Lamp.dim cannot be renamed: there is a flash already"));
  for (const json& bad :
       {json{{"name", "9a"}}, json{{"name", ""}}, json{{"name", "a b"}}, json{{"major", "255"}},
        json{{"minor", 1}}, json{{"udp_port", "65536"}}, json{{"methods", {{"dim", "0x0001"}}}},
        json{{"events", {{"burnt", {{"eventgroups", json::array()}}}}}},
        json{{"events", {{"burnt", {{"transport", "pigeon"}}}}}}}) {
    const web::Answer answer = page_.answer(post("/api/system", question({{"edits", {{"car.Lamp", bad}}}})));
    EXPECT_EQ(answer.status, 400U) << bad;
  }
}

/// A system of the lamp whose members have E2E protection, as a vsomeip JSON adds it.
json protected_lamp(json more = json::object()) {
  const std::string fdepl =
      "import "
      "\"platform:/plugin/org.genivi.commonapi.someip/deployment/CommonAPI-4-SOMEIP_deployment_spec.fdepl\"\n"
      "import \"Lamp.fidl\"\ndefine org.genivi.commonapi.someip.deployment for interface car.Lamp {\n"
      "SomeIpServiceID = 0x1234\nmethod flash { SomeIpMethodID = 0x21 }\n"
      "attribute level { SomeIpGetterID = 0x22 SomeIpSetterID = 0x23 SomeIpNotifierID = 0x8022 "
      "SomeIpNotifierEventGroups = { 1 } }\n"
      "broadcast burnt { SomeIpEventID = 0x8021 SomeIpEventGroups = { 1 } } }\n";
  const auto protection = [](const char* id) {
    return json{{"service_id", "0x1234"},
                {"event_id", id},
                {"profile", "P04"},
                {"variant", "checker"},
                {"data_id", "0x2d"}};
  };
  const json vsomeip{
      {"services", {{{"service", "0x1234"}, {"instance", "0x0001"}, {"unreliable", "30509"}}}},
      {"e2e",
       {{"e2e_enabled", "true"},
        {"protected",
         {protection("0x8021"), protection("0x0021"), protection("0x0022"), protection("0x0023")}}}}};
  json all = question(std::move(more));
  all["files"].push_back({{"name", "Lamp.fdepl"}, {"text", fdepl}});
  all["files"].push_back({{"name", "vsomeip.json"}, {"text", vsomeip.dump()}});
  return all;
}

TEST_F(PageTest, CallsMembersWithEndToEndProtection) {
  const json system = ask("/api/system", protected_lamp());
  ASSERT_TRUE(system["good"]) << system["problems"];
  ASSERT_TRUE(system["model"]["services"][0]["methods"][2].contains("e2e")) << system["model"]["services"][0];
  const auto call = page_.call(
      post("/api/call",
           protected_lamp(
               {{"service", "car.Lamp"}, {"kind", "fields"}, {"member", "level"}, {"access", "getter"}})));
  ASSERT_TRUE(call) << call.error().body;
  ASSERT_THAT(call->service.e2e, SizeIs(1));
  EXPECT_EQ(call->service.e2e[0].id, someip::MethodId{0x22});
  EXPECT_TRUE(call->service.e2e[0].protect);
  EXPECT_TRUE(call->service.e2e[0].check);
  EXPECT_EQ(call->note, "");
  // The check takes the header out; one that failed is told.
  const auto shown = [&](someip::e2e::CheckStatus status) {
    sd::Response response{.payload = {std::byte{7}}};
    response.check.emplace().status = status;
    return json::parse(call->show(response).body);
  };
  EXPECT_EQ(shown(someip::e2e::CheckStatus::ok)["ok"], true);
  EXPECT_EQ(shown(someip::e2e::CheckStatus::ok)["ranges"][0]["value"], "HIGH (7)");
  EXPECT_EQ(shown(someip::e2e::CheckStatus::repeated)["ok"], false);
  EXPECT_THAT(shown(someip::e2e::CheckStatus::repeated)["text"].get<std::string>(),
              HasSubstr("the E2E check of the answer failed: repeated"));
  const auto forget = page_.call(
      post("/api/call", protected_lamp({{"service", "car.Lamp"}, {"kind", "methods"}, {"member", "flash"}})));
  ASSERT_TRUE(forget) << forget.error().body;
  ASSERT_THAT(forget->service.e2e, SizeIs(1));
  EXPECT_FALSE(forget->service.e2e[0].check);
}

TEST_F(PageTest, ShowsTheHeaderOfEndToEndProtection) {
  const json asked = protected_lamp(
      {{"service", "car.Lamp"}, {"kind", "methods"}, {"member", "flash"}, {"part", "request"}});
  const json bare = ask("/api/layout", asked);
  EXPECT_EQ(bare["ranges"][0]["path"], "(E2E length)");
  EXPECT_EQ(bare["ranges"][4]["path"], "colour.red");
  json full = asked;
  full["values"] = R"({"colour": {"red": 5}})";
  const json shown = ask("/api/layout", full);
  ASSERT_TRUE(shown.contains("bytes")) << shown;
  EXPECT_EQ(shown["bytes"], 17);
  EXPECT_EQ(shown["ranges"][4]["hex"], "05");
  EXPECT_EQ(shown["ranges"][4]["offset"], "12");
}

TEST_F(PageTest, FindsTypesInTheFoldersThatItWasStartedWith) {
  const auto folder =
      std::filesystem::temp_directory_path() / ("trestle_page_test_" + std::to_string(getpid()));
  std::filesystem::create_directories(folder / "car_msgs" / "msg");
  std::ofstream{folder / "car_msgs" / "msg" / "Angle.msg"} << "uint16 degrees\n";
  const json files{{"files", {{{"name", "door_msgs/msg/Door.msg"}, {"text", "car_msgs/Angle angle\n"}}}}};
  EXPECT_FALSE(ask("/api/system", files)["good"]);
  Page page{{.type_folders = {folder.string()}}};
  const json system = json::parse(page.answer(post("/api/system", files)).body);
  std::filesystem::remove_all(folder);
  EXPECT_TRUE(system["good"]) << system["problems"];
}

TEST_F(PageTest, NamesFilesOfRosTypesInItsRouteFileAndSavesThemThere) {
  const json files{{"files", {{{"name", "door_msgs/msg/Door.msg"}, {"text", "uint8 angle\n"}}}}};
  json asked = files;
  asked["target"] = "routes";
  const json routes = ask("/api/preview", asked);
  ASSERT_THAT(routes["files"], SizeIs(1));
  EXPECT_THAT(routes["files"][0]["text"].get<std::string>(),
              HasSubstr("interfaces: [door_msgs/msg/Door.msg]"));
  asked["target"] = "msg";
  const json saved = ask("/api/preview", asked);
  ASSERT_THAT(saved["files"], SizeIs(1));
  EXPECT_EQ(saved["files"][0]["name"], "door_msgs/msg/Door.msg");
  EXPECT_EQ(saved["files"][0]["text"], "uint8 angle\n");
}

TEST_F(PageTest, TellsWhatIsWrongWithItsPlace) {
  const json system =
      ask("/api/system", {{"files", {{{"name", "a.fidl"}, {"text", "package a\ninterface {"}}}}});
  EXPECT_FALSE(system["good"]);
  EXPECT_TRUE(system["model"].is_null());
  const auto error = std::ranges::find_if(system["problems"],
                                          [](const json& problem) { return problem["severity"] == "error"; });
  ASSERT_NE(error, system["problems"].end());
  EXPECT_EQ((*error)["file"], "a.fidl");
  EXPECT_EQ((*error)["line"], 2);
}

TEST_F(PageTest, ShowsTheModelAlsoWhereIdsContradict) {
  const json system = ask(
      "/api/system",
      question(
          {{"edits",
            {{"car.Lamp", {{"methods", {{"dim", {{"id", "0x0042"}}}, {"flash", {{"id", "0x0042"}}}}}}}}}}));
  EXPECT_FALSE(system["good"]);
  EXPECT_FALSE(system["model"].is_null());
  EXPECT_THAT(system["problems"][0]["text"].get<std::string>(), HasSubstr("0x0042"));
  EXPECT_THAT(
      ask("/api/preview",
          question(
              {{"target", "fidl"},
               {"edits",
                {{"car.Lamp",
                  {{"methods", {{"dim", {{"id", "0x0042"}}}, {"flash", {{"id", "0x0042"}}}}}}}}}}))["files"],
      SizeIs(0));
}

TEST_F(PageTest, PreviewsEachTarget) {
  for (const Target& one : targets()) {
    const json preview = ask("/api/preview", question({{"target", one.name}}));
    EXPECT_FALSE(preview["files"].empty()) << one.name;
  }
  const json edited =
      ask("/api/preview", question({{"target", "routes"}, {"edits", {{"car.Lamp", {{"id", "0x1234"}}}}}}));
  ASSERT_THAT(edited["files"], SizeIs(1)) << edited;
  EXPECT_THAT(edited["files"][0]["text"].get<std::string>(), HasSubstr("0x1234"));
}

TEST_F(PageTest, ReadsNoFileOfTheMachine) {
  const std::string name = "trestle_page_test_" + std::to_string(getpid()) + ".fidl";
  const auto path = std::filesystem::temp_directory_path() / name;
  std::ofstream{path} << "package secret\ninterface TopSecret { version { major 1 minor 0 } }\n";
  const web::Answer answer = page_.answer(post(
      "/api/system", {{"files",
                       {{{"name", "a.fidl"}, {"text", "package a\nimport model \"" + path.string() + "\"\n"}},
                        {{"name", (path.parent_path() / "b.fidl").string()},
                         {"text", "package b\nimport model \"" + name + "\"\n"}}}}}));
  std::filesystem::remove(path);
  EXPECT_THAT(answer.body, HasSubstr("it is not among the files; add it"));
  EXPECT_THAT(answer.body, Not(HasSubstr("TopSecret")));
}

TEST_F(PageTest, FindsImportsAmongTheFiles) {
  const json system =
      ask("/api/system",
          {{"files",
            {{{"name", "A.fidl"},
              {"text",
               "package a\nimport b.* from \"../far/B.fidl\"\ninterface I { version { major 1 minor 0 } "
               "broadcast e { out { b.T.Kind kind } } }"}},
             {{"name", "B.fidl"}, {"text", "package b\ntypeCollection T { enumeration Kind { X } }"}}}}});
  EXPECT_TRUE(system["good"]) << system["problems"];
  EXPECT_EQ(system["model"]["services"][0]["name"], "I");
}

TEST_F(PageTest, MakesAFormOfTypes) {
  const json form = ask("/api/form", about("methods", "dim", {{"part", "request"}}));
  const json& fields = form["types"][form["type"].get<std::size_t>()]["fields"];
  EXPECT_EQ(fields[0]["label"], "level");
  EXPECT_EQ(fields[0]["enumerators"], json::parse(R"([["LOW","1"],["HIGH","7"]])"));
  EXPECT_EQ(fields[1]["kind"], "integer");
  EXPECT_EQ(fields[1]["array"], "list");
  EXPECT_EQ(fields[1]["high"], "65535");
  const json answer = ask("/api/form", about("methods", "dim", {{"part", "response"}}));
  EXPECT_EQ(answer["types"][0]["fields"][0]["label"], "error");
  EXPECT_EQ(answer["types"][0]["fields"][0]["enumerators"][1][0], "BROKEN");
  const json colour = ask("/api/form", about("methods", "flash", {{"part", "request"}}));
  const json& red = colour["types"].back()["fields"][0];
  EXPECT_EQ(red["label"], "red");
  EXPECT_EQ(red["high"], "255");
}

TEST_F(PageTest, LaysOutValues) {
  const json bare = ask("/api/layout", about("methods", "dim", {{"part", "request"}}));
  EXPECT_EQ(bare["ranges"][0]["path"], "level");
  EXPECT_FALSE(bare.contains("hex"));
  const json full =
      ask("/api/layout",
          about("methods", "dim", {{"part", "request"}, {"values", R"({"level": 7, "steps": [258]})"}}));
  EXPECT_EQ(full["hex"], "07000000020102");
  EXPECT_EQ(full["ranges"][0]["value"], "HIGH (7)");
  EXPECT_EQ(full["ranges"].back()["hex"], "0102");
  const json bad =
      ask("/api/layout", about("methods", "dim", {{"part", "request"}, {"values", R"({"level": 300})"}}));
  EXPECT_EQ(bad["field"], "level");
  EXPECT_THAT(bad["error"].get<std::string>(), HasSubstr("300"));
}

TEST_F(PageTest, PreparesCalls) {
  const json edits{
      {"car.Lamp", {{"id", "0x1234"}, {"instance", "0x0002"}, {"methods", {{"dim", {{"id", "0x0042"}}}}}}}};
  const auto call = page_.call(post(
      "/api/call", about("methods", "dim", {{"values", R"({"level": 1, "steps": []})"}, {"edits", edits}})));
  ASSERT_TRUE(call) << call.error().body;
  EXPECT_EQ(call->service.service, someip::ServiceId{0x1234});
  EXPECT_EQ(call->service.instance, someip::InstanceId{2});
  EXPECT_EQ(call->service.major, 2);
  EXPECT_EQ(call->call.method, someip::MethodId{0x42});
  EXPECT_THAT(call->payload,
              ElementsAre(std::byte{1}, std::byte{0}, std::byte{0}, std::byte{0}, std::byte{0}));
  EXPECT_FALSE(call->forget);
  const json shown = json::parse(call->show({.payload = {std::byte{1}, std::byte{1}}}).body);
  EXPECT_EQ(shown["ok"], true);
  EXPECT_EQ(shown["ranges"][0]["value"], "BROKEN (1)");
  EXPECT_THAT(shown["text"].get<std::string>(), HasSubstr("done: true"));
  const json cut = json::parse(call->show({.payload = {std::byte{1}}}).body);
  EXPECT_EQ(cut["ok"], false);

  const auto forget = page_.call(post("/api/call", about("methods", "flash")));
  ASSERT_TRUE(forget) << forget.error().body;
  EXPECT_TRUE(forget->forget);
  const auto get = page_.call(post("/api/call", about("fields", "level", {{"access", "getter"}})));
  ASSERT_TRUE(get);
  EXPECT_THAT(get->payload, SizeIs(0));
  EXPECT_FALSE(page_.call(post("/api/call", about("events", "burnt"))));
  EXPECT_FALSE(page_.call(post("/api/call", about("methods", "dim", {{"values", "{"}}))));
}

TEST_F(PageTest, RefusesWhatIsNoQuestion) {
  const auto status = [&](const std::string& path, const std::string& body) {
    return page_.answer({.method = "POST", .path = path, .body = body}).status;
  };
  EXPECT_EQ(status("/api/system", "no JSON"), 400U);
  EXPECT_EQ(status("/api/system", "[]"), 400U);
  EXPECT_EQ(status("/api/system", R"({"files": [1]})"), 400U);
  EXPECT_EQ(status("/api/system", R"({"edits": {"a": {"id": "0"}}})"), 400U);
  EXPECT_EQ(status("/api/system", R"({"edits": {"a": {"id": "0x10000"}}})"), 400U);
  EXPECT_EQ(status("/api/system", std::string(1'000'000, '[')), 400U);
  std::string many = "[0";
  for (std::size_t i = 0; i < max_question_values; ++i) {
    many += ",0";
  }
  EXPECT_EQ(status("/api/system", R"({"x": )" + many + "]}"), 400U);
  EXPECT_EQ(status("/api/other", "{}"), 404U);
  EXPECT_EQ(status("/api/preview", R"({"target": "nothing"})"), 404U);
  EXPECT_EQ(page_.answer({.method = "GET", .path = "/api/system"}).status, 404U);
}

TEST_F(PageTest, BearsWhateverIsAskedOfWhateverFile) {
  for (const char* path : {"/api/system", "/api/preview", "/api/form", "/api/layout"}) {
    for (const char* text : {"", "<AUTOSAR", "{", "package a", "interface", "\u0000"}) {
      const json body{{"target", "json"},
                      {"service", "x"},
                      {"kind", "methods"},
                      {"member", "y"},
                      {"files", {{{"name", "a.fidl"}, {"text", text}}, {{"name", ""}, {"text", text}}}}};
      EXPECT_EQ(page_.answer(post(path, body)).status, 200U) << path << " " << text;
    }
  }
  EXPECT_EQ(page_.answer({.method = "POST", .path = "/api/system", .body = "{\"target\": \"\xff\"}"}).status,
            400U);
}

TEST(PageAddress, IsAnAddressAndAPort) {
  EXPECT_EQ(parse_page_address("127.0.0.1:8030")->port, 8030);
  EXPECT_EQ(parse_page_address("8031")->address, IpAddress::v4(127, 0, 0, 1));
  EXPECT_TRUE(parse_page_address("[::1]:8030")->address.v6);
  for (const char* bad : {"", "x", "127.0.0.1", "127.0.0.1:", "127.0.0.1:70000", "::1:80", "localhost:1x"}) {
    EXPECT_FALSE(parse_page_address(bad)) << bad;
  }
}

}  // namespace
}  // namespace trestle::generate
