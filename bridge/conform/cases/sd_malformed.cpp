#include "bridge/conform/cases/all_cases.hpp"
#include "bridge/conform/trial.hpp"

namespace trestle::conform {
namespace {

/// A good Subscribe, broken in one way, that must not be acknowledged: a row of the table below.
struct Broken {
  const char* name;
  const char* title;
  std::vector<RequirementId> requirements;
  std::vector<Tc8Id> tc8;
  void (*breaks)(SdStimulus& stimulus);
  Level level = Level::must;
};

Case as_case(const Broken& row) {
  return {.id = std::string{"sd.subscribe.malformed."} + row.name,
          .title = row.title,
          .level = row.level,
          .requirements = row.requirements,
          .tc8 = row.tc8,
          .needs = Need::eventgroup,
          .run = [breaks = row.breaks](Trial& t) {
            SdStimulus stimulus = t.subscribe(t.eventgroup());
            breaks(stimulus);
            t.not_acknowledged(stimulus);
          }};
}

void set_option_length(SdStimulus& stimulus, unsigned length) {
  stimulus.options.front()[0] = static_cast<std::byte>(length >> 8U);
  stimulus.options.front()[1] = static_cast<std::byte>(length);
}

}  // namespace

void add_sd_malformed_cases(Cases& cases) {
  const std::vector<Broken> rows{
      {"entries-length-zero",
       "does not acknowledge a Subscribe with an entries array of length 0",
       {"feat_req_someipsd_44", "feat_req_someipsd_1163"},
       {"SOMEIP_ETS_111"},
       [](SdStimulus& s) { s.entries_length = 0; }},
      {"entries-length-short",
       "does not acknowledge a Subscribe whose entries array is shorter than an entry",
       {"feat_req_someipsd_44", "feat_req_someipsd_1163"},
       {"SOMEIP_ETS_125"},
       [](SdStimulus& s) { s.entries_length = 8; }},
      {"entries-length-odd",
       "does not acknowledge a Subscribe whose entries array is no multiple of 16",
       {"feat_req_someipsd_44", "feat_req_someipsd_1163"},
       {},
       [](SdStimulus& s) { s.entries_length = 17; }},
      {"entries-length-beyond",
       "does not acknowledge a Subscribe whose entries array is longer than the message",
       {"feat_req_someipsd_44", "feat_req_someipsd_1163"},
       {"SOMEIP_ETS_123"},
       [](SdStimulus& s) { s.entries_length = 0x0200; }},
      {"entries-length-into-options",
       "does not acknowledge a Subscribe whose entries array reaches into the options",
       {"feat_req_someipsd_44", "feat_req_someipsd_1163"},
       {"SOMEIP_ETS_124"},
       [](SdStimulus& s) { s.entries_length = 36; }},
      {"entries-length-huge",
       "does not acknowledge a Subscribe whose entries array has length 0xfffffff0",
       {"feat_req_someipsd_44", "feat_req_someipsd_1163"},
       {},
       [](SdStimulus& s) { s.entries_length = 0xffff'fff0; }},
      {"several-entries-cut",
       "does not acknowledge Subscribes whose entries array is cut in an entry",
       {"feat_req_someipsd_44", "feat_req_someipsd_1163"},
       {"SOMEIP_ETS_114"},
       [](SdStimulus& s) {
         s.entries.push_back(s.entries.front());
         s.entries.push_back(s.entries.front());
         s.entries_length = 40;
       }},
      {"options-length-zero",
       "does not acknowledge a Subscribe that refers into an options array of length 0",
       {"feat_req_someipsd_102", "feat_req_someipsd_1164"},
       {"SOMEIP_ETS_113"},
       [](SdStimulus& s) { s.options_length = 0; }},
      {"options-length-short",
       "does not acknowledge a Subscribe whose options array ends within the option",
       {"feat_req_someipsd_102", "feat_req_someipsd_1164"},
       {"SOMEIP_ETS_135", "SOMEIP_ETS_139"},
       [](SdStimulus& s) { s.options_length = 9; }},
      {"option-length-zero",
       "does not acknowledge a Subscribe whose endpoint option has Length 0",
       {"feat_req_someipsd_102", "feat_req_someipsd_129"},
       {"SOMEIP_ETS_112"},
       [](SdStimulus& s) { set_option_length(s, 0); }},
      {"option-length-short",
       "does not acknowledge a Subscribe whose endpoint option has Length 4",
       {"feat_req_someipsd_102", "feat_req_someipsd_129"},
       {"SOMEIP_ETS_136"},
       [](SdStimulus& s) { set_option_length(s, 4); }},
      {"option-length-long",
       "does not acknowledge a Subscribe whose endpoint option has Length 255",
       {"feat_req_someipsd_102", "feat_req_someipsd_129"},
       {},
       [](SdStimulus& s) { set_option_length(s, 255); }},
      {"options-misaligned",
       "does not acknowledge a Subscribe whose second option is shifted by a byte",
       {"feat_req_someipsd_102", "feat_req_someipsd_1164"},
       {"SOMEIP_ETS_137"},
       [](SdStimulus& s) {
         // The one that the entry refers to is the second; the first is a byte too long.
         Bytes first = s.options.front();
         set_option_length(s, 10);
         s.options.push_back(std::move(first));
         s.entries.front().first_run = {.index = 1, .count = 1};
       }},
      {"option-unknown",
       "does not acknowledge a Subscribe whose only option is of unknown type 0x77",
       {"feat_req_someipsd_1142", "feat_req_someipsd_102"},
       {"SOMEIP_ETS_116"},
       [](SdStimulus& s) { s.options.front()[2] = std::byte{0x77}; }},
      {"option-unknown-long",
       "does not acknowledge a Subscribe whose only option is of unknown type 0xf0, and long",
       {"feat_req_someipsd_1142", "feat_req_someipsd_102"},
       {"SOMEIP_ETS_174"},
       [](SdStimulus& s) { s.options.front() = raw_option(64, 0xf0, Bytes(64, std::byte{0x11})); }},
      {"too-many-options",
       "does not acknowledge a Subscribe that refers to more options than there are",
       {"feat_req_someipsd_102"},
       {"SOMEIP_ETS_115"},
       [](SdStimulus& s) { s.entries.front().first_run.count = 3; }},
      {"option-index-beyond",
       "does not acknowledge a Subscribe that refers to options behind the last one",
       {"feat_req_someipsd_102"},
       {},
       [](SdStimulus& s) { s.entries.front().first_run.index = 9; }},
      {"length-and-options-cut",
       "does not acknowledge a Subscribe whose Length and options array are cut",
       {"feat_req_someipsd_44", "feat_req_someipsd_1163"},
       {"SOMEIP_ETS_134"},
       [](SdStimulus& s) {
         s.length = 44;
         s.options_length = 8;
       }},
      {"length-short",
       "does not acknowledge a Subscribe whose SOME/IP Length is shorter than its content",
       {"feat_req_someip_77", "feat_req_someipsd_1163"},
       {"SOMEIP_ETS_153"},
       [](SdStimulus& s) { s.length = 30; }},
      {"length-long",
       "does not acknowledge a Subscribe whose SOME/IP Length is beyond the datagram",
       {"feat_req_someip_77", "feat_req_someipsd_1220"},
       {},
       [](SdStimulus& s) { s.length = 400; }},
      {"wrong-method",
       "does not acknowledge a Subscribe under a Method ID other than 0x8100",
       {"feat_req_someipsd_26", "feat_req_someipsd_1220"},
       {"SOMEIP_ETS_178"},
       [](SdStimulus& s) { s.method = someip::MethodId{0x8200}; }},
      {"unknown-entry-type",
       "does not acknowledge an entry of unknown type 0x55",
       {"feat_req_someipsd_46", "feat_req_someipsd_1164"},
       {},
       [](SdStimulus& s) { s.entries.front().type = sd::EntryType{0x55}; }},
  };
  for (const Broken& row : rows) {
    cases.push_back(as_case(row));
  }
  cases.push_back(
      {.id = "sd.subscribe.malformed.options-length-beyond",
       .title = "acknowledges or ignores a Subscribe whose options array is longer than the message",
       .level = Level::tc8,
       .requirements = {"feat_req_someipsd_44"},
       .tc8 = {"SOMEIP_ETS_138"},
       .needs = Need::eventgroup,
       .run = [](Trial& t) {
         SdStimulus stimulus = t.subscribe(t.eventgroup());
         stimulus.options_length = 200;
         const std::size_t since = t.now();
         t.send_sd(stimulus);
         t.pass();
         for (const SeenEntry& seen : t.entries_since(since, [](const SeenEntry& one) {
                return one.entry.kind() == sd::EntryKind::subscribe_eventgroup_nack;
              })) {
           t.different("answer", "an Ack, or none", "a Nack", seen.packet);
         }
       }});
}

}  // namespace trestle::conform
