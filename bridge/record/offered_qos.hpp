#pragma once
#include <span>
#include <string>
#include <vector>

#include "dds_adapter/participant.hpp"

namespace trestle::record {

/// The quality of service of a topic's writers as rosbag2 notes it with a channel, `offered_qos_profiles`: a
/// YAML list, with the numbers of rmw that every distribution reads. History and depth are those of an end
/// that was discovered: not known.
[[nodiscard]] std::string offered_qos(std::span<const dds::Qos> writers);

/// The other way, of numbers and of the words that rosbag2 writes since Jazzy; what is not known or not there
/// is as by default.
/// @return empty, where the text is no such list.
[[nodiscard]] std::vector<dds::Qos> writers_of(const std::string& text);

/// What a writer offers so that readers of all of these find what they ask for, where they asked for what was
/// offered: the most of each.
[[nodiscard]] dds::Qos most_of(std::span<const dds::Qos> writers);
/// What a reader asks for that gets the samples of all of these: the least of each.
[[nodiscard]] dds::Qos least_of(std::span<const dds::Qos> writers);

}  // namespace trestle::record
