// bridge/describe/write/wireshark: a profile by which Wireshark shows the names and values of payloads.
//
//   write_wireshark.hpp  the whole writer: the tables of Wireshark's SOME/IP dissector, and `preferences`
//
// Each table is a file of lines with quoted columns, in the order that the dissector declares them.
// docs/describe.md says what Wireshark cannot show.
#pragma once
#include "bridge/describe/model.hpp"
#include "bridge/describe/write/written.hpp"

namespace trestle::describe {

/// Writes a profile of Wireshark (4.0 and later) by which it shows names and values of the model's payloads:
/// the tables SOMEIP_… of its SOME/IP dissector and `preferences` with the ports of the instances. The files
/// go into a folder "profiles/NAME" of Wireshark's configuration folder.
///
/// A payload that Wireshark cannot take apart is left out, so that it is shown as bytes, and told: bit
/// fields, little endian length fields, alignment, a choice whose selector comes before its length, strings
/// without length field that end by a terminator.
[[nodiscard]] Written write_wireshark(const Model& model);

}  // namespace trestle::describe
