#include <gmock/gmock.h>
#include <unistd.h>

#include <array>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>

#include "bridge/describe/write/wireshark/write_wireshark.hpp"
#include "test/bridge/describe/lost.hpp"

namespace trestle::describe {
namespace {

using messages::Primitive;
using someip::DataId;
using someip::FieldWidth;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;

std::string big(std::uint64_t number, int bytes) {
  std::string out;
  for (int at = bytes - 1; at >= 0; --at) {
    out += static_cast<char>((number >> (8 * at)) & 0xff);
  }
  return out;
}
std::string little(std::uint64_t number, int bytes) {
  std::string out = big(number, bytes);
  std::reverse(out.begin(), out.end());
  return out;
}
std::string counted(const std::string& bytes, int width = 4) {
  return big(bytes.size(), width) + bytes;
}
std::string utf8(const std::string& text) {
  return "\xef\xbb\xbf" + text + '\0';
}

/// A service with every kind of type.
class Everything {
 public:
  Everything() {
    u8 = add({.kind = Kind::primitive, .primitive = Primitive::uint8});
    u16 = add({.kind = Kind::primitive, .primitive = Primitive::uint16});
    u32 = add({.kind = Kind::primitive, .primitive = Primitive::uint32});
    f64 = add({.kind = Kind::primitive, .primitive = Primitive::float64});
    text = add({.kind = Kind::string});
    model.services.push_back(
        {.name = "Car", .scope = "org.example", .id = someip::ServiceId{0x1234}, .major = 16});
    model.services[0].eventgroups = {{.name = "all", .id = someip::EventgroupId{1}}};
    model.instances.push_back({.service = "org.example.Car",
                               .id = someip::InstanceId{1},
                               .udp_port = std::uint16_t{30501},
                               .tcp_port = std::uint16_t{30502}});
  }
  TypeIndex add(Type type) { return model.add(std::move(type)); }
  static Value value(std::string name, TypeIndex type, Wire wire = {}) {
    return {.name = std::move(name), .type = type, .wire = wire};
  }
  static Wire length(FieldWidth width) { return {.length = width}; }
  Service& service() { return model.services[0]; }
  void event(std::string name, unsigned id, Payload payload) {
    service().events.push_back(
        {.name = std::move(name), .id = static_cast<someip::MethodId>(id), .payload = std::move(payload)});
  }

  Model model;
  TypeIndex u8{}, u16{}, u32{}, f64{}, text{};
};

/// A capture of messages of the service 0x1234, version 16.
class Conversation {
 public:
  void message(unsigned method, unsigned type, const std::string& payload) {
    const std::string someip = big(0x1234, 2) + big(method, 2) + big(payload.size() + 8, 4) + big(1, 4) +
                               big(1, 1) + big(16, 1) + big(type, 1) + big(0, 1) + payload;
    const std::string udp = big(30501, 2) + big(40000, 2) + big(8 + someip.size(), 2) + big(0, 2) + someip;
    const std::string ip = big(0x4500, 2) + big(20 + udp.size(), 2) + big(0x00010000, 4) +
                           big(0x40110000, 4) + big(0xc0a80001, 4) + big(0xc0a80002, 4) + udp;
    const std::string frame = std::string(12, '\x02') + big(0x0800, 2) + ip;
    pcap_ += little(1, 4) + little(0, 4) + little(frame.size(), 4) + little(frame.size(), 4) + frame;
  }
  [[nodiscard]] std::string pcap() const {
    return little(0xa1b2c3d4, 4) + little(2, 2) + little(4, 2) + std::string(8, '\0') + little(65535, 4) +
           little(1, 4) + pcap_;
  }

 private:
  std::string pcap_;
};

void put(const std::filesystem::path& file, const std::string& text) {
  std::filesystem::create_directories(file.parent_path());
  std::ofstream{file, std::ios::binary} << text;
}
std::string text_of(const std::filesystem::path& file) {
  std::ifstream in{file, std::ios::binary};
  return {std::istreambuf_iterator<char>{in}, {}};
}

std::string file_of(const Written& written, const std::string& path) {
  for (const TextFile& file : written.files) {
    if (file.path == path) {
      return file.text;
    }
  }
  return "no such file";
}

/// tshark with what the writer made.
class Tshark : public ::testing::Test {
 protected:
  void SetUp() override {
    if (std::system("tshark --version >/dev/null 2>&1") != 0) {
      GTEST_SKIP() << "there is no tshark";
    }
    folder_ = std::filesystem::path{::testing::TempDir()} / ("trestle_wireshark_" + std::to_string(getpid()));
    std::filesystem::remove_all(folder_);
  }
  void TearDown() override {
    if (!folder_.empty()) {
      std::filesystem::remove_all(folder_);
    }
  }

  /// The payloads as tshark shows them: the lines below "Payload:".
  std::string decode(const Written& written, const Conversation& conversation) {
    for (const TextFile& file : written.files) {
      put(folder_ / "profiles" / "car" / file.path, file.text);
    }
    put(folder_ / "c.pcap", conversation.pcap());
    const std::string in = folder_.string();
    const std::string command = "WIRESHARK_CONFIG_DIR=" + in + " tshark -C car -r " + in +
                                "/c.pcap -V -O someip >" + in + "/out 2>" + in + "/err";
    EXPECT_EQ(std::system(command.c_str()), 0);
    // Errors of tables are told there alone.
    std::string errors = text_of(folder_ / "err");
    if (errors.starts_with("Running as user")) {
      errors.erase(0, errors.find('\n') + 1);
    }
    EXPECT_EQ(errors, "");
    return text_of(folder_ / "out");
  }

 private:
  std::filesystem::path folder_;
};

TEST_F(Tshark, ShowsNamesAndValuesOfEveryKind) {
  Everything all;
  Model& model = all.model;
  const TypeIndex side =
      all.add({.kind = Kind::enumeration,
               .name = "Side",
               .primitive = Primitive::int8,
               .enumerators = {{.name = "NONE", .value = -1}, {.name = "RIGHT", .value = 18}}});
  const TypeIndex meters = all.add({.kind = Kind::alias, .name = "Meters", .element = {.type = all.f64}});
  const TypeIndex point =
      all.add({.kind = Kind::structure,
               .name = "Point",
               .members = {Everything::value("x", meters), Everything::value("side", side)}});
  const TypeIndex points =
      all.add({.kind = Kind::array, .element = {.type = point, .wire = {.length = FieldWidth::bits8}}});
  const TypeIndex pair =
      all.add({.kind = Kind::array, .element = {.type = all.u16}, .max_size = 2, .fixed_size = true});
  const TypeIndex rows =
      all.add({.kind = Kind::array, .element = {.type = pair}, .max_size = 2, .fixed_size = true});
  const TypeIndex choice =
      all.add({.kind = Kind::choice,
               .name = "Either",
               .members = {Everything::value("number", all.u16),
                           Everything::value("text", all.text, default_wire(Kind::string))},
               .selectors = {1, 18}});
  const TypeIndex map = all.add({.kind = Kind::map,
                                 .element = {.type = all.u16},
                                 .key = {.type = all.text, .wire = {.length = FieldWidth::bits8}}});
  const TypeIndex bytes = all.add({.kind = Kind::bytes});
  const TypeIndex flag = all.add({.kind = Kind::primitive, .primitive = Primitive::boolean});
  all.event(
      "mixed", 0x8001,
      {.values = {
           Everything::value("points", points, Everything::length(FieldWidth::bits16)),
           Everything::value("rows", rows), Everything::value("which", choice, default_wire(Kind::choice)),
           Everything::value("named", map, default_wire(Kind::map)),
           Everything::value("raw", bytes, default_wire(Kind::bytes)),
           Everything::value("wide", all.text,
                             {.length = FieldWidth::bits32, .encoding = someip::StringEncoding::utf16le}),
           Everything::value("plate", all.text, {.fixed_bytes = 8}), Everything::value("open", flag),
           Everything::value("small", all.u32, {.byte_order = std::endian::little})}});
  const Written written = write_wireshark(model);
  EXPECT_THAT(written.not_carried, IsEmpty());
  Conversation conversation;
  conversation.message(
      0x8001, 2,
      counted(
          counted(big(0x3ff8000000000000, 8) + "\xff", 1) + counted(big(0x4000000000000000, 8) + "\x12", 1),
          2) +
          big(1, 2) + big(2, 2) + big(3, 2) + big(4, 2) + big(10, 4) + big(18, 4) + counted(utf8("or")) +
          counted(counted(utf8("k"), 1) + big(7, 2)) + counted("\x05\x06") +
          counted(std::string{"\xff\xfe"} + std::string{"h\0i\0\0\0", 6}) + utf8("ab") +
          std::string(2, '\0') + "\x01" + little(258, 4));
  const std::string shown = decode(written, conversation);
  for (const char* line : {"Service ID: 0x1234 (Car)", "Method ID: 0x8001 (mixed)", "x [float64]: 1.5\n",
                           "side [uint8]: 255 (NONE)\n", "side [uint8]: 18 (RIGHT)\n",
                           "array rows (elements limit: 2)", "element [uint16]: 4\n", "union which [Either]",
                           "text [string]: \xef\xbb\xbfor\n", "struct element [map_entry]",
                           "value [uint16]: 7\n", "element [uint8]: 6\n", "wide [string]: \xef\xbb\xbfhi\n",
                           "plate [string]: \xef\xbb\xbf"
                           "ab\n",
                           "open [boolean]: 1\n", "small [uint32_le]: 258\n"}) {
    EXPECT_THAT(shown, HasSubstr(line));
  }
  EXPECT_THAT(shown, Not(HasSubstr("Malformed")));
  EXPECT_THAT(shown, Not(HasSubstr("nparsed")));
}

TEST_F(Tshark, ShowsMethodsFieldsTagsAndE2e) {
  Everything all;
  const TypeIndex error =
      all.add({.kind = Kind::enumeration,
               .name = "OpenError",
               .primitive = Primitive::uint8,
               .enumerators = {{.name = "OK", .value = 0}, {.name = "JAMMED", .value = 1}}});
  Value tagged = Everything::value("name", all.text, default_wire(Kind::string));
  tagged.tag = DataId{5};
  Value first = Everything::value("speed", all.u16);
  first.tag = DataId{1};
  all.service().methods = {{.name = "open",
                            .id = someip::MethodId{1},
                            .request = {.values = {first, tagged}, .tagged_length = FieldWidth::bits16},
                            .response = {.values = {Everything::value("angle", all.u16)}},
                            .error = error},
                           {.name = "fire",
                            .id = someip::MethodId{2},
                            .request = {.values = {Everything::value("n", all.u8)}},
                            .fire_and_forget = true}};
  all.service().fields = {{.name = "light",
                           .payload = {.values = {Everything::value("light", all.u8)}},
                           .getter = someip::MethodId{3},
                           .setter = someip::MethodId{4},
                           .notifier = someip::MethodId{0x8003}},
                          {.name = "lock",
                           .payload = {.values = {Everything::value("lock", all.u8)}},
                           .getter = someip::MethodId{5},
                           .setter = someip::MethodId{6},
                           .has_notifier = false,
                           .getter_e2e = {.profile = "4", .numbers = {{"data_id", 2}}},
                           .setter_e2e = {.profile = "5", .numbers = {{"data_id", 3}, {"data_bits", 8}}}}};
  all.event("safe", 0x8002,
            {.values = {Everything::value("v", all.u8)},
             .byte_order = std::endian::little,
             .length_fields_always_big = true});
  all.service().events[0].e2e = {.profile = "4", .numbers = {{"data_id", 1}}};
  // Marked by comments, which tshark takes.
  all.service().id_is_chosen = all.service().eventgroups[0].id_is_chosen = true;
  all.service().chosen_ids = {someip::MethodId{1}};
  const Written written = write_wireshark(all.model);
  const std::string chosen = "\n# chosen by Trestle, not given by a description:\n";
  EXPECT_THAT(file_of(written, "SOMEIP_service_identifiers"), HasSubstr(chosen + "\"1234\",\"Car\"\n"));
  EXPECT_THAT(file_of(written, "SOMEIP_method_event_identifiers"),
              HasSubstr(chosen + "\"1234\",\"0001\",\"open\"\n\"1234\",\"0002\",\"fire\"\n"));
  EXPECT_THAT(file_of(written, "SOMEIP_eventgroup_identifiers"),
              HasSubstr(chosen + "\"1234\",\"0001\",\"all\"\n"));
  EXPECT_THAT(written.not_carried, IsEmpty());
  Conversation conversation;
  conversation.message(1, 0x00, big(0x1001, 2) + big(9, 2) + big(0x4005, 2) + counted(utf8("me"), 2));
  conversation.message(1, 0x80, "\x01" + big(300, 2));
  conversation.message(2, 0x01, "\x21");
  conversation.message(3, 0x80, "\x22");
  conversation.message(4, 0x00, "\x23");
  conversation.message(0x8003, 0x02, "\x24");
  conversation.message(0x8002, 0x02, std::string(12, '\x07') + "\x25");
  conversation.message(5, 0x00, std::string(12, '\x08'));
  conversation.message(5, 0x80, std::string(12, '\x07') + "\x26");
  conversation.message(6, 0x00, std::string(3, '\x07') + "\x27");
  conversation.message(6, 0x80, std::string(3, '\x07') + "\x28");
  const std::string shown = decode(written, conversation);
  for (const char* line :
       {"Method ID: 0x0001 (open)", "speed [uint16]: 9\n", "name [string]: \xef\xbb\xbfme\n",
        "error [uint8]: 1 (JAMMED)\n", "angle [uint16]: 300\n", "n [uint8]: 33\n", "(light_get)",
        "light [uint8]: 34\n", "(light_set)", "light [uint8]: 35\n", "(light)", "light [uint8]: 36\n",
        "array e2e_header (elements limit: 12)", "v [uint8]: 37\n", "E2E header [uint8]: 8\n",
        "lock [uint8]: 38\n", "array e2e_header (elements limit: 3)", "lock [uint8]: 39\n",
        "lock [uint8]: 40\n"}) {
    EXPECT_THAT(shown, HasSubstr(line));
  }
  EXPECT_THAT(shown, Not(HasSubstr("nparsed")));
  EXPECT_THAT(shown, Not(HasSubstr("Malformed")));
}

TEST(WriteWireshark, WritesThePortsOfTheInstances) {
  EXPECT_EQ(
      file_of(write_wireshark(Everything{}.model), "preferences"),
      "someip.udp.port: 30490,30501\nsomeip.tcp.port: 30502\nsomeip.payload_dissector_activated: TRUE\n");
}

TEST(WriteWireshark, NamesEventgroupsByWhatIsInThem) {
  Everything all;
  all.event("moved", 0x8001, {});
  all.event("heated", 0x8002, {});
  for (Event& event : all.service().events) {
    event.eventgroups = {someip::EventgroupId{2}};
  }
  all.service().eventgroups.push_back({.id = someip::EventgroupId{2}});
  all.service().eventgroups.push_back({.id = someip::EventgroupId{3}});
  EXPECT_THAT(file_of(write_wireshark(all.model), "SOMEIP_eventgroup_identifiers"),
              HasSubstr("\"1234\",\"0001\",\"all\"\n\"1234\",\"0002\",\"moved, heated\"\n"
                        "\"1234\",\"0003\",\"eventgroup_0003\"\n"));
}

TEST(WriteWireshark, LeavesOutWhatWiresharkHasNoFormFor) {
  Everything all;
  const TypeIndex loop = all.add({.kind = Kind::structure, .name = "Loop"});
  all.model.at(loop).members = {Everything::value("again", loop)};
  const TypeIndex bits = all.add(
      {.kind = Kind::structure, .name = "Bits", .members = {Everything::value("b", all.u8, {.bits = 3})}});
  const TypeIndex list = all.add({.kind = Kind::array, .element = {.type = bits}});
  all.event("loop", 0x8001, {.values = {Everything::value("v", loop)}});
  all.event("bits", 0x8002, {.values = {Everything::value("v", list, default_wire(Kind::array))}});
  all.event("again", 0x8003, {.values = {Everything::value("n", all.u8), Everything::value("v", bits)}});
  all.event("little", 0x8004,
            {.values = {Everything::value("v", all.text, default_wire(Kind::string))},
             .byte_order = std::endian::little});
  all.event("line", 0x8005, {.values = {Everything::value("v", all.text)}});
  const TypeIndex shape = all.add({.kind = Kind::structure,
                                   .name = "Shape",
                                   .members = {Everything::value("n", all.u8)},
                                   .polymorphic = true});
  const TypeIndex disc = all.add({.kind = Kind::structure, .name = "Disc", .base = shape});
  all.event("shape", 0x8007, {.values = {Everything::value("v", disc)}});
  all.event("apart", 0x8008, {.values = {Everything::value("n", all.u8)}});
  all.service().events.back().e2e = {.profile = "4", .numbers = {{"data_id", 1}}};
  all.service().events.back().e2e.set(someip::InstanceId{2}, {.profile = "7", .numbers = {{"data_id", 1}}});
  all.event("good", 0x8006, {.values = {Everything::value("n", all.u8)}});
  const Written written = write_wireshark(all.model);
  EXPECT_THAT(lines_of(written.not_carried),
              ElementsAre("org.example.Car.loop: a structure that contains itself",
                          "org.example.Car.bits: bit fields", "org.example.Car.again: bit fields",
                          "org.example.Car.little: little endian length fields",
                          "org.example.Car.line: a string without length field that ends by its terminator",
                          "org.example.Car.shape: a polymorphic structure",
                          "org.example.Car.apart: E2E protection that is not the same in all instances: in "
                          "instance 0x0002 profile 7"));
  // No rows of theirs are left.
  EXPECT_EQ(file_of(written, "SOMEIP_parameter_list"),
            "# written by Trestle\n"
            "\"1234\",\"8006\",\"16\",\"02\",\"FALSE\",\"1\",\"0\",\"n\",\"1\",\"2\",\"Car.m8006_02.n\"\n");
  EXPECT_EQ(file_of(written, "SOMEIP_parameter_structs"), "# written by Trestle\n");
  EXPECT_THAT(file_of(written, "SOMEIP_method_event_identifiers"), HasSubstr("\"8001\",\"loop\""));
}

TEST(WriteWireshark, TakesTypesThatContainThemselvesByAnArray) {
  Everything all;
  const TypeIndex node = all.add({.kind = Kind::structure, .name = "Node"});
  const TypeIndex nodes = all.add({.kind = Kind::array, .element = {.type = node}});
  all.model.at(node).members = {Everything::value("children", nodes, default_wire(Kind::array))};
  all.event("tree", 0x8001, {.values = {Everything::value("root", node)}});
  EXPECT_THAT(write_wireshark(all.model).not_carried, IsEmpty());
}

}  // namespace
}  // namespace trestle::describe
