#include "bridge/describe/change_rules.hpp"

#include <algorithm>
#include <array>

namespace trestle::describe {
namespace comparing {
namespace {

using enum Impact;

constexpr std::array rules{
    ChangeRule{"service-added", none, none, "a new service"},
    ChangeRule{"service-removed", breaking, breaking, "clients no longer find it"},
    ChangeRule{"service-renamed", none, breaking, "the same id under another name"},
    ChangeRule{"service-id", breaking, none, "old clients look for another service"},
    ChangeRule{"service-major", breaking, breaking, "clients ask for the other major version"},
    ChangeRule{"deployment-missing", compatible, none,
               "one of the two gives no ids, as a FIDL file without its FDEPL, and differs in layout or "
               "transport: what it leaves open is not compared"},
    ChangeRule{"service-minor", compatible, none,
               "clients that ask for a higher minor version do not find it"},
    ChangeRule{"method-added", compatible, none, "old servers answer E_UNKNOWN_METHOD"},
    ChangeRule{"method-removed", breaking, breaking, "old clients get E_UNKNOWN_METHOD"},
    ChangeRule{"method-renamed", none, breaking, "the same id under another name"},
    ChangeRule{"method-id", breaking, none, "old clients call another method, or none"},
    ChangeRule{"method-fire-and-forget", breaking, breaking,
               "one side waits for an answer that does not come"},
    ChangeRule{"method-timeout", none, none, "clients wait for another time"},
    ChangeRule{"event-added", compatible, none, "old clients ignore it; old servers do not send it"},
    ChangeRule{"event-removed", breaking, breaking, "old clients wait for it"},
    ChangeRule{"event-renamed", none, breaking, "the same id under another name"},
    ChangeRule{"event-id", breaking, none, "old clients do not know the id"},
    ChangeRule{"event-eventgroups", breaking, none, "a subscription brings other events"},
    ChangeRule{"event-eventgroups-added", compatible, none, "other subscriptions bring it, too"},
    ChangeRule{"event-selective", compatible, breaking,
               "a server sends it to those that it chooses, or to all subscribers"},
    ChangeRule{"event-cycle", none, none, "it comes more often, or more seldom"},
    ChangeRule{"field-added", compatible, none, "old servers do not have it"},
    ChangeRule{"field-removed", breaking, breaking, "old clients use it"},
    ChangeRule{"field-renamed", none, breaking, "the same ids under another name"},
    ChangeRule{"field-id", breaking, none, "old clients use the other id"},
    ChangeRule{"field-access-added", compatible, none,
               "a getter, setter or notifier that old servers do not have"},
    ChangeRule{"field-access-removed", breaking, breaking,
               "a getter, setter or notifier that old clients use"},
    ChangeRule{"transport", breaking, none, "old clients use the other transport"},
    ChangeRule{"segmentation", compatible, none, "other segments or pauses: receivers cope"},
    ChangeRule{"collecting", none, none, "messages wait for others for another time"},
    ChangeRule{"byte-order", breaking, none, "numbers are read the wrong way round"},
    ChangeRule{"alignment", breaking, none, "what follows stands elsewhere"},
    ChangeRule{"protection", breaking, none, "the other side's check fails"},
    ChangeRule{"value-renamed", none, breaking, "another name at the same place"},
    ChangeRule{"value-moved", breaking, breaking,
               "the one that stood here stands elsewhere: each reads the other"},
    ChangeRule{"value-appended", breaking, breaking,
               "at the end: old receivers skip it, new receivers miss it in old messages"},
    ChangeRule{
        "value-appended-behind-length", compatible, breaking,
        "at the end of a structure with a length field: old receivers skip it; new ones use a default"},
    ChangeRule{"value-removed", breaking, breaking, "what follows stands elsewhere, or the end is missing"},
    ChangeRule{"member-optional-added", compatible, none, "a tagged optional member: old receivers skip it"},
    ChangeRule{"member-optional-removed", compatible, breaking, "new receivers skip it"},
    ChangeRule{"member-tag", breaking, none,
               "the receiver takes it for another member, or for an unknown one"},
    ChangeRule{"member-optional", breaking, breaking, "one side cannot do without it"},
    ChangeRule{"type-changed", breaking, breaking, "other bytes, and another type in code"},
    ChangeRule{"type-form", none, breaking,
               "the same bytes, and another type in code: a number and an enumeration, bytes and an array"},
    ChangeRule{"type-renamed", none, breaking, "the same bytes under another name"},
    ChangeRule{"layout", breaking, none, "length field, encoding or width differ"},
    ChangeRule{"size-fixed", breaking, breaking, "another number of elements"},
    ChangeRule{"size-raised", breaking, none, "old receivers may refuse what is longer"},
    ChangeRule{"size-lowered", breaking, breaking, "new receivers may refuse what old senders send"},
    ChangeRule{"value-range", none, compatible, "other values are good ones"},
    ChangeRule{"value-invalid", none, compatible, "another value, or none, says that there is no value"},
    ChangeRule{"value-unit", none, breaking, "the same number means something else"},
    ChangeRule{"value-default", none, compatible, "another value where nobody gives one"},
    ChangeRule{"enumerator-added", compatible, none, "old receivers do not know the value"},
    ChangeRule{"enumerator-removed", compatible, breaking, "old senders may still send it"},
    ChangeRule{"enumerator-renamed", none, breaking, "the same value under another name"},
    ChangeRule{"enumerator-value", breaking, none, "the same name for another number"},
    ChangeRule{"alternative-added", compatible, none, "old receivers refuse a message that has it"},
    ChangeRule{"alternative-removed", breaking, breaking, "new receivers refuse it"},
    ChangeRule{"alternative-selector", breaking, none, "the receiver takes it for another alternative"},
    ChangeRule{"error-changed", none, compatible,
               "the first value of the answer is an error on one side alone: its bytes are compared as any"},
    ChangeRule{"instance-added", none, none, "a new instance that is offered"},
    ChangeRule{"instance-removed", breaking, none, "clients no longer find it"},
    ChangeRule{"client-added", none, none, "a host that uses the service"},
    ChangeRule{"client-removed", none, none, "a host that uses it no more"},
    ChangeRule{"instance-id", breaking, none, "clients look for another instance"},
    ChangeRule{"instance-endpoint", compatible, none,
               "service discovery tells where it is; who has it written down misses it"},
    ChangeRule{"instance-multicast", compatible, none, "service discovery tells subscribers the group"},
    ChangeRule{"instance-timing", compatible, none, "it is found sooner or later, or for another time"},
    ChangeRule{"instance-settings", compatible, none,
               "another version, eventgroups that a client uses, load balancing, configuration options"},
    ChangeRule{"constant-added", none, none, "a new constant"},
    ChangeRule{"constant-removed", none, breaking, "applications use it"},
    ChangeRule{"constant-renamed", none, breaking, "the same value under another name"},
    ChangeRule{"constant-value", none, compatible, "applications that were built before have the old one"},
    ChangeRule{"not-compared", breaking, breaking,
               "too many types, or nested too deep: the rest was not compared"},
};

}  // namespace

const ChangeRule& rule(std::string_view id) {
  return *std::ranges::find(rules, id, &ChangeRule::id);
}

}  // namespace comparing

std::span<const ChangeRule> change_rules() {
  return comparing::rules;
}

}  // namespace trestle::describe
