#include "bridge/describe/allocate.hpp"

#include <fmt/format.h>
#include <gmock/gmock.h>

#include <algorithm>
#include <set>

namespace trestle::describe {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;
using ::testing::StartsWith;

/// Of a text that is good.
IdLock lock_of(const std::string& text) {
  std::vector<documents::Problem> problems;
  const auto lock = read_id_lock("ids.lock", text, problems);
  EXPECT_THAT(problems, IsEmpty());
  return lock.value();
}

Service service(std::string name) {
  Service service{.name = std::move(name), .scope = "car"};
  service.methods = {{.name = "open"}, {.name = "shut"}};
  service.events = {{.name = "moved"}};
  service.fields = {{.name = "label"}, {.name = "angle", .has_setter = false}};
  return service;
}

/// "service method method | event | getter setter notifier ..." of one service.
std::string ids(const Service& service) {
  const auto text = [](const auto& id) {
    return id ? std::to_string(static_cast<unsigned>(*id)) : std::string{"-"};
  };
  std::string all;
  for (const Method& method : service.methods) {
    all += text(method.id) + " ";
  }
  for (const Event& event : service.events) {
    all += text(event.id) + " ";
  }
  for (const Field& field : service.fields) {
    all += text(field.getter) + " " + text(field.setter) + " " + text(field.notifier) + " ";
  }
  return all;
}

TEST(AllocateIds, NumbersMembersInTheirOrder) {
  Model model{.services = {service("Door")}};
  IdLock lock;
  EXPECT_THAT(allocate_ids(model, lock), IsEmpty());
  EXPECT_EQ(ids(model.services[0]), "1 2 32769 3 4 32770 5 - 32771 ");
  EXPECT_THAT(model.services[0].fields[0].eventgroups, ElementsAre(someip::EventgroupId{1}));
  ASSERT_EQ(model.instances.size(), 1);
  EXPECT_EQ(model.instances[0].service, "car.Door");
  EXPECT_EQ(model.instances[0].id, someip::InstanceId{1});
}

TEST(AllocateIds, GivesWhatIsInheritedTheIdsOfItsBase) {
  Model model{.services = {service("Front"), service("Door")}};
  Service& front = model.services[0];
  front.base = "car.Door";
  front.methods.push_back({.name = "lock"});
  IdLock lock;
  EXPECT_THAT(allocate_ids(model, lock), IsEmpty());
  EXPECT_EQ(ids(model.services[1]), "1 2 32769 3 4 32770 5 - 32771 ");
  EXPECT_EQ(ids(model.services[0]), "1 2 6 32769 3 4 32770 5 - 32771 ");

  // What was chosen before stays, and what it uses itself.
  Model again{.services = {service("Front"), service("Door")}};
  again.services[0].base = "car.Door";
  again.services[0].methods.push_back({.name = "lock", .id = someip::MethodId{2}});
  IdLock before;
  before.services["car.Front"].methods["open"] = 7;
  EXPECT_THAT(allocate_ids(again, before), IsEmpty());
  EXPECT_EQ(ids(again.services[0]), "7 1 2 32769 3 4 32770 5 - 32771 ");
  EXPECT_EQ(ids(again.services[1]), "7 1 32769 3 4 32770 5 - 32771 ") << "a FDEPL file says them once";
}

TEST(AllocateIds, TellsWhichEventsNobodyHasPutIntoAnEventgroup) {
  const auto told = [](Service one) {
    Model model{.files = {"Door.fidl", "Door.fdepl"}, .services = {std::move(one)}};
    IdLock lock;
    std::string all;
    for (const documents::Problem& problem : allocate_ids(model, lock)) {
      all += to_string(problem) + "\n";
    }
    EXPECT_EQ(model.services[0].events[0].eventgroups, model.services[0].fields[0].eventgroups);
    return all;
  };
  Service one = service("Door");
  EXPECT_EQ(told(one), "") << "nobody has chosen any ids";
  one.events[0].id = someip::MethodId{0x8005};
  one.events[0].id_place = {.file = 1, .mark = {7, 9}};
  EXPECT_EQ(told(one), "Door.fdepl:7:9: warning: Door.moved is in no eventgroup: 0x0001 is taken\n");
  one.eventgroups = {{.id = someip::EventgroupId{6}}, {.id = someip::EventgroupId{4}}};
  EXPECT_EQ(told(one),
            "Door.fdepl:7:9: warning: Door.moved and 2 more are in no eventgroup: 0x0004 is taken\n");
}

/// Which eventgroups there are, a client of vsomeip has in its program.
TEST(AllocateIds, LeavesEventgroupsOpenOfWhichAClientAloneTells) {
  const auto told = [](Instance::Role role) {
    Service one{.name = "service_0001", .id = someip::ServiceId{1}};
    one.events = {{.name = "event_8001", .id = someip::MethodId{0x8001}, .payload = {.known = false}}};
    Model model{.services = {one}, .instances = {{.role = role, .service = "service_0001"}}};
    model.instances[0].id = someip::InstanceId{1};
    IdLock lock;
    const std::size_t count = allocate_ids(model, lock).size();
    EXPECT_EQ(model.services[0].events[0].eventgroups.size(), count);
    return count;
  };
  EXPECT_EQ(told(Instance::Role::required), 0U);
  EXPECT_EQ(told(Instance::Role::provided), 1U);
}

TEST(AllocateIds, GivesWhatIsInheritedTheEventgroupsOfItsBase) {
  Model model{.services = {service("Front"), service("Door")}};
  model.services[0].base = "car.Door";
  model.services[0].eventgroups = {{.id = someip::EventgroupId{3}}, {.id = someip::EventgroupId{9}}};
  model.services[0].events.push_back({.name = "locked", .eventgroups = {someip::EventgroupId{3}}});
  for (Event& event : model.services[1].events) {
    event.eventgroups = {someip::EventgroupId{7}};
  }
  model.services[1].eventgroups = {{.name = "doors", .id = someip::EventgroupId{7}}};
  IdLock lock;
  const std::vector<documents::Problem> problems = allocate_ids(model, lock);
  ASSERT_EQ(problems.size(), 1);
  EXPECT_EQ(problems[0].text, "Door.label and 1 more are in no eventgroup: 0x0007 is taken");
  const Service& front = model.services[0];
  EXPECT_THAT(front.events[0].eventgroups, ElementsAre(someip::EventgroupId{7}));
  EXPECT_THAT(front.fields[0].eventgroups, ElementsAre(someip::EventgroupId{7}));
  EXPECT_THAT(front.events[1].eventgroups, ElementsAre(someip::EventgroupId{3}));
  ASSERT_EQ(front.eventgroups.size(), 3);
  EXPECT_EQ(front.eventgroups[1].id, someip::EventgroupId{7});
  EXPECT_EQ(front.eventgroups[1].name, "doors");
}

/// A base and two that extend it, one through the other. Each has a method of its own, and an event.
Model family() {
  Model model{.services = {service("Rear"), service("Front"), service("Door")}};
  model.services[1].base = "car.Door";
  model.services[0].base = "car.Front";
  for (const auto& [at, name] : {std::pair{std::size_t{0}, "wipe"}, {1U, "lock"}, {0U, "lock"}}) {
    model.services.at(at).methods.push_back({.name = name});
    model.services.at(at).events.push_back({.name = std::string{name} + "ed"});
  }
  return model;
}

TEST(AllocateIds, GivesWhatIsNewInABaseAnIdThatIsFreeInItsHeirs) {
  Model first = family();
  IdLock lock;
  EXPECT_THAT(allocate_ids(first, lock), IsEmpty());
  EXPECT_EQ(ids(first.services[2]), "1 2 32769 3 4 32770 5 - 32771 ");
  EXPECT_EQ(ids(first.services[1]), "1 2 6 32769 32772 3 4 32770 5 - 32771 ");
  EXPECT_EQ(ids(first.services[0]), "1 2 7 6 32769 32773 32772 3 4 32770 5 - 32771 ");

  const auto grow = [](Service& service) {
    service.methods.push_back({.name = "more"});
    service.events.push_back({.name = "mored"});
  };
  IdLock together = lock_of(to_text(lock));
  Model grown = family();
  std::ranges::for_each(grown.services, grow);
  EXPECT_THAT(allocate_ids(grown, together), IsEmpty());
  EXPECT_EQ(ids(grown.services[2]), "1 2 8 32769 32774 3 4 32770 5 - 32771 ");
  EXPECT_EQ(ids(grown.services[1]), "1 2 6 8 32769 32772 32774 3 4 32770 5 - 32771 ");
  EXPECT_EQ(ids(grown.services[0]), "1 2 7 6 8 32769 32773 32772 32774 3 4 32770 5 - 32771 ");

  // Also where the lock alone knows the heirs, and they come again later.
  IdLock apart = lock_of(to_text(lock));
  Model alone{.services = {grown.services[2]}};
  alone.services[0].methods.back().id.reset();
  alone.services[0].events.back().id.reset();
  EXPECT_THAT(allocate_ids(alone, apart), IsEmpty());
  EXPECT_EQ(ids(alone.services[0]), ids(grown.services[2]));
  Model later = family();
  std::ranges::for_each(later.services, grow);
  apart = lock_of(to_text(apart));
  EXPECT_THAT(allocate_ids(later, apart), IsEmpty());
  EXPECT_EQ(ids(later.services[0]), ids(grown.services[0]));
  EXPECT_EQ(to_text(apart), to_text(together));
}

TEST(AllocateIds, LeavesABaseWhatItsHeirsAreGiven) {
  Model model{.services = {service("Front"), service("Door")}};
  model.services[0].base = "car.Door";
  model.services[0].methods.push_back({.name = "lock", .id = someip::MethodId{1}});
  model.services[0].methods[1].id = someip::MethodId{9};  // of what it inherits: the base gets it, too
  model.services[0].events.push_back(
      {.name = "locked", .id = someip::MethodId{0x8001}, .eventgroups = {someip::EventgroupId{1}}});
  IdLock lock;
  EXPECT_THAT(allocate_ids(model, lock), IsEmpty());
  EXPECT_EQ(ids(model.services[1]), "2 9 32770 3 4 32771 5 - 32772 ");
  EXPECT_EQ(ids(model.services[0]), "2 9 1 32770 32769 3 4 32771 5 - 32772 ");
}

TEST(AllocateIds, KeepsWhatABaseHasHadAndTellsThatAnHeirHasIt) {
  IdLock lock;
  lock.services["car.Door"].methods["open"] = 1;
  Model model{.services = {service("Front"), service("Door")}};
  model.services[0].base = "car.Door";
  model.services[0].methods.push_back({.name = "lock", .id = someip::MethodId{1}});
  model.services[0].methods[0].place = {.file = 0, .mark = {7, 3}};
  const std::vector<documents::Problem> problems = allocate_ids(model, lock);
  ASSERT_EQ(problems.size(), 1);
  EXPECT_EQ(problems[0].severity, documents::Problem::Severity::warning);
  EXPECT_EQ(problems[0].mark, (documents::Mark{7, 3}));
  EXPECT_EQ(problems[0].text,
            "Front.open cannot have the id 0x0001 of Door.open, which Front.lock has: another one is chosen, "
            "which no FDEPL file can say");
  EXPECT_EQ(model.services[1].methods[0].id, someip::MethodId{1});
  EXPECT_EQ(model.services[0].methods[0].id, someip::MethodId{6});
}

TEST(AllocateIds, GuessesNoEventgroupOfWhatACaptureShows) {
  Model model{.services = {service("Door")}};
  model.services[0].eventgroups = {{.id = someip::EventgroupId{5}}, {.id = someip::EventgroupId{7}}};
  model.services[0].events[0].observed_bytes = 4;
  model.services[0].events[0].payload.known = false;
  IdLock lock;
  const std::vector<documents::Problem> of_fields = allocate_ids(model, lock);
  ASSERT_EQ(of_fields.size(), 1);
  EXPECT_EQ(of_fields[0].text, "Door.label and 1 more are in no eventgroup: 0x0005 is taken");
  EXPECT_THAT(model.services[0].events[0].eventgroups, IsEmpty());
  EXPECT_THAT(model.services[0].fields[0].eventgroups, ElementsAre(someip::EventgroupId{5}));
  // Of one that is described, too, a route needs it: with a warning.
  model.services[0].events[0].payload.known = true;
  const std::vector<documents::Problem> problems = allocate_ids(model, lock);
  ASSERT_EQ(problems.size(), 1);
  EXPECT_EQ(problems[0].severity, documents::Problem::Severity::warning);
  EXPECT_EQ(problems[0].text, "Door.moved: the capture does not tell its eventgroup; 0x0005 is taken");
  EXPECT_THAT(model.services[0].events[0].eventgroups, ElementsAre(someip::EventgroupId{5}));
}

TEST(AllocateIds, GivesProvidedInstancesWithoutIdOneWithAWarning) {
  Model model{.services = {service("Door")}};
  model.instances = {{.service = "car.Door", .id = someip::InstanceId{1}},
                     {.service = "car.Door"},
                     {.role = Instance::Role::required, .service = "car.Door"}};
  IdLock lock;
  const std::vector<documents::Problem> problems = allocate_ids(model, lock);
  ASSERT_EQ(problems.size(), 1);
  EXPECT_EQ(problems[0].severity, documents::Problem::Severity::warning);
  EXPECT_EQ(model.instances[1].id, someip::InstanceId{2});
  EXPECT_EQ(model.instances[2].id, std::nullopt) << "any";
}

TEST(AllocateIds, LeavesWhatIsGiven) {
  Model model{.services = {service("Door")}};
  model.services[0].id = someip::ServiceId{0x1234};
  model.services[0].methods[1].id = someip::MethodId{1};
  model.services[0].events[0].eventgroups = {someip::EventgroupId{7}};
  model.services[0].eventgroups = {{.id = someip::EventgroupId{7}}, {.id = someip::EventgroupId{5}}};
  model.instances = {{.service = "car.Door", .id = someip::InstanceId{9}}};
  IdLock lock;
  const std::vector<documents::Problem> problems = allocate_ids(model, lock);
  ASSERT_EQ(problems.size(), 1);
  EXPECT_EQ(problems[0].severity, documents::Problem::Severity::warning);
  EXPECT_EQ(problems[0].text, "Door.label and 1 more are in no eventgroup: 0x0005 is taken");
  EXPECT_EQ(model.services[0].id, someip::ServiceId{0x1234});
  EXPECT_EQ(ids(model.services[0]), "2 1 32769 3 4 32770 5 - 32771 ");
  EXPECT_THAT(model.services[0].events[0].eventgroups, ElementsAre(someip::EventgroupId{7}));
  EXPECT_THAT(model.services[0].fields[0].eventgroups, ElementsAre(someip::EventgroupId{5}));
  EXPECT_EQ(model.instances.size(), 1);
  EXPECT_FALSE(lock.services.at("car.Door").service);  // given, not chosen
}

TEST(AllocateIds, MarksWhatItChose) {
  Model model{.services = {service("Door"), service("Lamp")}};
  Service& door = model.services[0];
  door.id = someip::ServiceId{0x1234};
  door.methods[1].id = someip::MethodId{1};
  door.events[0].eventgroups = {someip::EventgroupId{7}};
  door.eventgroups = {{.id = someip::EventgroupId{7}}};
  model.instances = {{.service = "car.Door", .id = someip::InstanceId{9}}};
  // What is inherited has ids of both kinds.
  model.services[1].base = "car.Door";
  model.services[1].events.clear();
  model.services[1].fields.clear();
  IdLock lock;
  EXPECT_EQ(allocate_ids(model, lock).size(), 1) << "the members without an eventgroup";
  EXPECT_FALSE(door.id_is_chosen);
  EXPECT_FALSE(door.eventgroups[0].id_is_chosen);
  EXPECT_FALSE(model.instances[0].id_is_chosen);
  const auto chosen = [](std::initializer_list<std::uint16_t> ids) {
    std::set<someip::MethodId> all;
    for (const std::uint16_t id : ids) {
      all.insert(someip::MethodId{id});
    }
    return all;
  };
  EXPECT_EQ(door.chosen_ids, chosen({2, 3, 4, 5, 0x8001, 0x8002, 0x8003}));
  const Service& lamp = model.services[1];
  EXPECT_EQ(ids(lamp), "2 1 ");
  EXPECT_TRUE(lamp.id_is_chosen);
  EXPECT_EQ(lamp.chosen_ids, chosen({2}));
  ASSERT_EQ(model.instances.size(), 2);
  EXPECT_TRUE(model.instances[1].id_is_chosen);

  Model bare{.services = {service("Door")}};
  IdLock other;
  EXPECT_THAT(allocate_ids(bare, other), IsEmpty());
  ASSERT_EQ(bare.services[0].eventgroups.size(), 1);
  EXPECT_TRUE(bare.services[0].eventgroups[0].id_is_chosen);
}

TEST(AllocateIds, GivesServicesTheSameIdsWhateverIsBesideThem) {
  Model alone{.services = {service("Door")}};
  IdLock lock;
  EXPECT_THAT(allocate_ids(alone, lock), IsEmpty());
  Model beside{.services = {service("Window"), service("Door"), service("Seat")}};
  IdLock other;
  EXPECT_THAT(allocate_ids(beside, other), IsEmpty());
  EXPECT_EQ(beside.services[1].id, alone.services[0].id);
}

TEST(AllocateIds, ChangesNothingTheSecondTime) {
  Model first{.services = {service("Door"), service("Window")}};
  IdLock lock;
  EXPECT_THAT(allocate_ids(first, lock), IsEmpty());
  const std::string text = to_text(lock);
  IdLock again = lock_of(text);
  // Something new before what there was, and something gone.
  Model second{.services = {service("Window"), service("Door")}};
  second.services[1].methods = {{.name = "lock"}, {.name = "shut"}};
  EXPECT_THAT(allocate_ids(second, again), IsEmpty());
  EXPECT_EQ(second.services[1].id, first.services[0].id);
  EXPECT_EQ(ids(second.services[0]), ids(first.services[1]));
  EXPECT_EQ(ids(second.services[1]), "6 2 32769 3 4 32770 5 - 32771 ");  // 1 was that of "open"
  EXPECT_THAT(allocate_ids(first, again), IsEmpty());
}

TEST(AllocateIds, GivesAwayWhatTheModelGivesToAnotherOne) {
  Model model{.services = {service("Door")}};
  IdLock lock;
  EXPECT_THAT(allocate_ids(model, lock), IsEmpty());
  const std::uint16_t id = *lock.services.at("car.Door").service;
  Model later{.services = {service("Door"), service("Window")}};
  later.services[0].methods[1].id = someip::MethodId{1};  // which "open" has had
  later.services[1].id = someip::ServiceId{id};
  const std::vector<documents::Problem> problems = allocate_ids(later, lock);
  EXPECT_EQ(later.services[0].methods[0].id, someip::MethodId{6});
  EXPECT_NE(later.services[0].id, someip::ServiceId{id});
  ASSERT_EQ(problems.size(), 2);
  EXPECT_EQ(
      problems[0].text,
      fmt::format("the service car.Door has had the id 0x{0:04x}, which car.Window has now: 0x{1:04x} is "
                  "taken",
                  id, someip::value(*later.services[0].id)));
  EXPECT_EQ(problems[1].text, "Door.open has had the id 0x0001, which shut has now: 0x0006 is taken");
  EXPECT_THAT(allocate_ids(later, lock), IsEmpty()) << "told once";
}

TEST(AllocateIds, NeverGivesOneIdTwiceAndSaysWhenNoneIsLeft) {
  Model model;
  for (int i = 0; i < 9; ++i) {
    model.services.push_back({.name = "S" + std::to_string(i)});
  }
  IdLock lock;
  const auto problems = allocate_ids(model, lock, {0x10, 0x17});
  std::set<someip::ServiceId> ids;
  for (const Service& one : model.services) {
    if (one.id) {
      EXPECT_TRUE(ids.insert(*one.id).second);
    }
  }
  EXPECT_EQ(ids.size(), 8);
  ASSERT_EQ(problems.size(), 1);
  EXPECT_EQ(problems[0].text, "no service id is left for 'S8'");
}

std::vector<std::string> faults_of_lock(const std::string& text) {
  std::vector<documents::Problem> problems;
  const auto lock = read_id_lock("ids.lock", text, problems);
  std::vector<std::string> all;
  for (const documents::Problem& problem : problems) {
    all.push_back(to_string(problem));
  }
  const auto is_error = [](const std::string& one) { return one.find(": error: ") != std::string::npos; };
  EXPECT_EQ(lock.has_value(), std::ranges::none_of(all, is_error));
  return all;
}

TEST(ReadIdLock, SaysWhereItIsWrong) {
  EXPECT_THAT(faults_of_lock("services:\n  - name: car.Door\n    id: 0x12345\n    methods: {open: x}\n"),
              ElementsAre(StartsWith("ids.lock:3:9: error: id:"), StartsWith("ids.lock:4:21: error: open:")));
}

/// [feat_req_someipids_505] [feat_req_someipids_555] [feat_req_someipids_636]
TEST(ReadIdLock, JudgesReservedIdsAsThoseOfDescriptions) {
  EXPECT_THAT(
      faults_of_lock("services:\n"
                     "  - {name: A, id: 0x0000}\n"
                     "  - {name: B, id: 0xffff}\n"
                     "  - {name: C, id: 0xfffe}\n"
                     "  - name: D\n"
                     "    id: 0x4000\n"
                     "    methods:\n"
                     "      open: 0x0000\n"
                     "      shut: 0x7fff\n"
                     "      ring: 0x8001\n"
                     "    events:\n"
                     "      moved: 0x8000\n"
                     "      bent: 0x0001\n"
                     "      label/notifier: 0xffff\n"),
      ElementsAre("ids.lock:2:19: error: service A has the id 0x0000, which is reserved: give it another one",
                  "ids.lock:3:19: error: service B has the id 0xffff, which is that of service discovery and "
                  "magic cookies: give it another one",
                  "ids.lock:4:19: warning: service C has the id 0xfffe, by which service discovery announces "
                  "services of other protocols",
                  "ids.lock:8:13: warning: D.open has the id 0x0000, which is reserved: other stacks may "
                  "refuse it",
                  "ids.lock:9:13: warning: D.shut has the id 0x7fff, which is reserved: other stacks may "
                  "refuse it",
                  "ids.lock:10:13: warning: D.ring has the id 0x8001: methods have no bit 15, from 0x0001 to "
                  "0x7ffe",
                  "ids.lock:12:14: warning: D.moved has the id 0x8000, which is reserved: other stacks may "
                  "refuse it",
                  "ids.lock:13:13: warning: D.bent has the id 0x0001: events have bit 15, from 0x8001 on",
                  "ids.lock:14:23: warning: D.label/notifier has the id 0xffff, which is reserved: other "
                  "stacks may refuse it"));
}

/// As Git makes it of two branches that each have added something.
TEST(ReadIdLock, TellsWhatHasOneIdTwiceAfterAMerge) {
  const std::string what_to_do = ": remove the line of one that nobody uses yet, and another id is chosen";
  EXPECT_THAT(
      faults_of_lock("services:\n"
                     "  - name: car.Door\n"
                     "    id: 0x4000\n"
                     "    methods:\n"
                     "      open: 0x0001\n"
                     "      shut: 0x0001\n"
                     "    events:\n"
                     "      moved: 0x8001\n"
                     "      bent: 0x8001\n"
                     "  - name: car.Window\n"
                     "    id: 0x4000\n"),
      ElementsAre(
          "ids.lock:6:13: error: methods: 0x0001 of 'shut' is that of 'open' in line 5, too" + what_to_do,
          "ids.lock:9:13: error: events: 0x8001 of 'bent' is that of 'moved' in line 8, too" + what_to_do,
          "ids.lock:11:9: error: id: 0x4000 of car.Window is that of car.Door in line 3, too" + what_to_do));
  // One branch has added to a base, the other one to what extends it.
  const std::string family =
      "services:\n"
      "  - name: car.Door\n"
      "    methods:\n"
      "      open: 0x0001\n"
      "      more: 0x0002\n"
      "  - name: car.Front\n"
      "    extends: car.Door\n"
      "    methods:\n"
      "      lock: 0x0002\n";
  EXPECT_THAT(faults_of_lock(family),
              ElementsAre("ids.lock:9:13: error: methods: 0x0002 of 'lock' is that of 'more' of car.Door, "
                          "which car.Front extends, in line 5, too" +
                          what_to_do));
  EXPECT_THAT(faults_of_lock(family + "      more: 0x0003\n"), IsEmpty()) << "it has an id of its own";
  EXPECT_THAT(faults_of_lock("services:\n  - {name: A, extends: A, methods: {a: 1}}\n"), IsEmpty());
}

}  // namespace
}  // namespace trestle::describe
