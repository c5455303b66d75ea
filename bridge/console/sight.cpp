#include "bridge/console/sight.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <nlohmann/json.hpp>
#include <optional>
#include <string_view>
#include <utility>

#include "bridge/messages/values/cdr.hpp"

namespace trestle::console {
namespace {

using messages::CdrReader;

/// What is seen: the description, and the bytes.
struct Seen {
  nlohmann::json about;
  std::string bytes{};
};

Seen nothing(std::string why) {
  return {{{"kind", "none"}, {"why", std::move(why)}}};
}

std::string text_of(CdrReader& in) {
  const ByteView characters = in.take(in.number<std::uint32_t>());
  std::string text;
  for (const std::byte one : characters.first(std::max<std::size_t>(characters.size(), 1) - 1)) {
    text += static_cast<char>(one);
  }
  return text;
}
double float64_of(CdrReader& in) {
  return std::bit_cast<double>(in.number<std::uint64_t>());
}
/// std_msgs/msg/Header: its frame.
std::string frame_of(CdrReader& in) {
  in.number<std::uint32_t>();
  in.number<std::uint32_t>();
  return text_of(in);
}

/// sensor_msgs/msg/PointField
struct PointField {
  std::string name;
  std::uint32_t offset = 0;
  std::uint8_t datatype = 0;
};
constexpr std::array<std::size_t, 9> datatype_bytes{0, 1, 1, 2, 2, 4, 4, 4, 8};

double value_at(const std::byte* at, std::uint8_t datatype, std::endian order) {
  switch (datatype) {
    case 1:
      return static_cast<std::int8_t>(someip::load<std::uint8_t>(at, order));
    case 2:
      return someip::load<std::uint8_t>(at, order);
    case 3:
      return static_cast<std::int16_t>(someip::load<std::uint16_t>(at, order));
    case 4:
      return someip::load<std::uint16_t>(at, order);
    case 5:
      return static_cast<std::int32_t>(someip::load<std::uint32_t>(at, order));
    case 6:
      return someip::load<std::uint32_t>(at, order);
    case 7:
      return std::bit_cast<float>(someip::load<std::uint32_t>(at, order));
    default:
      return std::bit_cast<double>(someip::load<std::uint64_t>(at, order));
  }
}

const PointField* field_of(const std::vector<PointField>& fields, std::string_view name) {
  const auto found = std::ranges::find(fields, name, &PointField::name);
  return found == fields.end() ? nullptr : &*found;
}

Seen cloud(CdrReader in) {
  Seen seen{{{"kind", "cloud"}, {"frame", frame_of(in)}}};
  const std::size_t height = in.number<std::uint32_t>();
  const std::size_t width = in.number<std::uint32_t>();
  std::vector<PointField> fields;
  for (std::uint32_t count = in.number<std::uint32_t>(); count > 0 && !in.failed(); --count) {
    PointField& one = fields.emplace_back();
    one.name = text_of(in);
    one.offset = in.number<std::uint32_t>();
    one.datatype = in.number<std::uint8_t>();
    in.number<std::uint32_t>();
  }
  const std::endian order = in.number<std::uint8_t>() != 0 ? std::endian::big : std::endian::little;
  const std::size_t point_step = in.number<std::uint32_t>();
  const std::size_t row_step = in.number<std::uint32_t>();
  const ByteView data = in.take(in.number<std::uint32_t>());
  const PointField* value = nullptr;
  for (const char* const name : {"intensity", "intensities", "reflectivity", "i"}) {
    value = value == nullptr ? field_of(fields, name) : value;
  }
  std::vector<const PointField*> read{field_of(fields, "x"), field_of(fields, "y"), field_of(fields, "z")};
  if (value != nullptr) {
    read.push_back(value);
  }
  for (const PointField* const one : read) {
    if (one == nullptr) {
      return nothing("the points have no x, y and z");
    }
    if (one->datatype == 0 || one->datatype >= datatype_bytes.size() || one->offset > point_step ||
        datatype_bytes.at(one->datatype) > point_step - one->offset) {
      return nothing("the fields do not lie within the points");
    }
  }
  // Each row has its points, and the data its rows.
  if (width > 0 && height > 0 &&
      (row_step > data.size() / height || width > row_step / std::max<std::size_t>(point_step, 1))) {
    return nothing("the points do not lie within the data");
  }
  const std::size_t points = width * height;
  const std::size_t every = std::max<std::size_t>(1, (points + most_points - 1) / most_points);
  std::size_t not_finite = 0;
  std::size_t sent = 0;
  seen.bytes.resize((points + every - 1) / every * 16);
  auto* const out = seen.bytes.data();
  for (std::size_t i = 0; i < points; i += every) {
    const std::byte* const at = data.data() + i / width * row_step + i % width * point_step;
    std::array<float, 4> numbers{};
    for (std::size_t k = 0; k < read.size(); ++k) {
      numbers.at(k) = static_cast<float>(value_at(at + read[k]->offset, read[k]->datatype, order));
    }
    if (!std::isfinite(numbers[0]) || !std::isfinite(numbers[1]) || !std::isfinite(numbers[2])) {
      ++not_finite;
      continue;
    }
    numbers[3] = value == nullptr || !std::isfinite(numbers[3]) ? numbers[2] : numbers[3];
    for (std::size_t k = 0; k < numbers.size(); ++k) {
      std::array<std::byte, 4> bytes{};
      someip::store(bytes.data(), std::bit_cast<std::uint32_t>(numbers.at(k)), std::endian::little);
      std::ranges::transform(bytes, out + sent * 16 + k * 4,
                             [](std::byte one) { return static_cast<char>(one); });
    }
    ++sent;
  }
  seen.bytes.resize(sent * 16);
  seen.about.update({{"points", points},
                     {"sent", sent},
                     {"not_finite", not_finite},
                     {"every", every},
                     {"value", value == nullptr ? std::string{} : value->name}});
  return seen;
}

/// Where red, green and blue lie in a pixel, and whether it has alpha.
struct Encoding {
  std::string_view name;
  std::size_t bytes;
  std::array<std::size_t, 3> places;
};
constexpr std::array encodings{Encoding{"rgb8", 3, {0, 1, 2}},   Encoding{"bgr8", 3, {2, 1, 0}},
                               Encoding{"rgba8", 4, {0, 1, 2}},  Encoding{"bgra8", 4, {2, 1, 0}},
                               Encoding{"mono8", 1, {0, 0, 0}},  Encoding{"8UC1", 1, {0, 0, 0}},
                               Encoding{"8UC3", 3, {2, 1, 0}},   Encoding{"8UC4", 4, {2, 1, 0}},
                               Encoding{"mono16", 2, {1, 1, 1}}, Encoding{"16UC1", 2, {1, 1, 1}}};

Seen image(CdrReader in) {
  Seen seen{{{"kind", "image"}, {"frame", frame_of(in)}}};
  const std::size_t height = in.number<std::uint32_t>();
  const std::size_t width = in.number<std::uint32_t>();
  const std::string name = text_of(in);
  const bool is_big = in.number<std::uint8_t>() != 0;
  const std::size_t step = in.number<std::uint32_t>();
  const ByteView data = in.take(in.number<std::uint32_t>());
  const auto encoding = std::ranges::find(encodings, std::string_view{name}, &Encoding::name);
  if (encoding == encodings.end()) {
    return nothing(fmt::format("pictures of encoding {} are not shown", name));
  }
  if (width == 0 || height == 0 || step > data.size() / height || width > step / encoding->bytes) {
    return nothing("the picture does not lie within the data");
  }
  std::size_t every = 1;
  while (((width + every - 1) / every) * ((height + every - 1) / every) > most_pixels) {
    ++every;
  }
  for (std::size_t y = 0; y < height; y += every) {
    for (std::size_t x = 0; x < width; x += every) {
      const std::byte* const at = data.data() + y * step + x * encoding->bytes;
      for (const std::size_t place : encoding->places) {
        // Of 16 bits the upper half.
        seen.bytes += static_cast<char>(at[encoding->bytes == 2 && is_big ? 0 : place]);
      }
      seen.bytes += '\xff';
    }
  }
  seen.about.update({{"width", width},
                     {"height", height},
                     {"encoding", name},
                     {"sent_width", (width + every - 1) / every},
                     {"sent_height", (height + every - 1) / every}});
  return seen;
}

Seen compressed(CdrReader in) {
  Seen seen{{{"kind", "compressed"}, {"frame", frame_of(in)}}};
  const std::string format = text_of(in);
  const ByteView data = in.take(in.number<std::uint32_t>());
  if (data.size() > most_compressed_bytes) {
    return nothing("the picture is too large to be shown");
  }
  seen.bytes.assign(data.size(), '\0');
  std::ranges::transform(data, seen.bytes.begin(), [](std::byte one) { return static_cast<char>(one); });
  const std::string_view begin{seen.bytes};
  const char* const mime = begin.starts_with("\xff\xd8")  ? "image/jpeg"
                           : begin.starts_with("\x89PNG") ? "image/png"
                                                          : nullptr;
  if (mime == nullptr) {
    return nothing(fmt::format("pictures of format {} are not shown", format));
  }
  seen.about.update({{"format", format}, {"mime", mime}});
  return seen;
}

Seen fix(CdrReader in) {
  Seen seen{{{"kind", "fix"}, {"frame", frame_of(in)}}};
  const auto status = static_cast<std::int8_t>(in.number<std::uint8_t>());
  in.number<std::uint16_t>();
  const double latitude = float64_of(in);
  const double longitude = float64_of(in);
  const double altitude = float64_of(in);
  if (!std::isfinite(latitude) || !std::isfinite(longitude)) {
    return nothing("it knows no position");
  }
  seen.about.update(
      {{"status", status}, {"latitude", latitude}, {"longitude", longitude}, {"altitude", altitude}});
  return seen;
}

Seen frames(CdrReader in) {
  Seen seen{{{"kind", "frames"}, {"transforms", nlohmann::json::array()}}};
  const std::size_t count = in.number<std::uint32_t>();
  for (std::size_t i = 0; i < std::min(count, most_transforms) && !in.failed(); ++i) {
    std::string parent = frame_of(in);
    std::string child = text_of(in);
    nlohmann::json numbers = nlohmann::json::array();
    for (int k = 0; k < 7; ++k) {
      numbers.push_back(float64_of(in));
    }
    seen.about["transforms"].push_back({{"parent", std::move(parent)},
                                        {"child", std::move(child)},
                                        {"translation", {numbers[0], numbers[1], numbers[2]}},
                                        {"rotation", {numbers[3], numbers[4], numbers[5], numbers[6]}}});
  }
  return seen;
}

using See = Seen (*)(CdrReader);
constexpr std::array<std::pair<std::string_view, See>, 5> sights{
    {{"sensor_msgs/msg/PointCloud2", cloud},
     {"sensor_msgs/msg/Image", image},
     {"sensor_msgs/msg/CompressedImage", compressed},
     {"sensor_msgs/msg/NavSatFix", fix},
     {"tf2_msgs/msg/TFMessage", frames}}};

Seen see(const ShownMessage& shown) {
  if (shown.newest->bytes.empty()) {
    return nothing("it is too large to be shown");
  }
  const auto forms = both_forms(shown);
  if (!forms) {
    return nothing(forms.error());
  }
  const auto what =
      std::ranges::find(sights, std::string_view{shown.type}, [](const auto& one) { return one.first; });
  // Made by the conversion just now: in the host's byte order, and whole. A type of this name that somebody
  // has changed may still be shorter; what is read beyond the end is zeros.
  return what == sights.end()
             ? nothing("there is nothing to see of this type")
             : what->second(CdrReader{ByteView{forms->sample}.subspan(4), std::endian::native});
}

}  // namespace

bool is_sight(std::string_view type) {
  return std::ranges::any_of(sights, [&](const auto& one) { return one.first == type; });
}

std::string sight(const ShownMessage& shown) {
  Seen seen = see(shown);
  seen.about["route"] = shown.route;
  seen.about["at_ns"] = shown.newest->at_ns;
  seen.about["size"] = shown.newest->size;
  std::string json = seen.about.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
  json.resize((json.size() + 3) / 4 * 4, ' ');
  std::string out;
  for (unsigned shift = 0; shift < 32; shift += 8) {
    out += static_cast<char>(json.size() >> shift & 0xffU);
  }
  return out + json + seen.bytes;
}

}  // namespace trestle::console
