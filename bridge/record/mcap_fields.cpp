#include "bridge/record/mcap_fields.hpp"

#include <fmt/format.h>

namespace trestle::record {
namespace {

ByteView bytes_of(std::string_view text) {
  return std::as_bytes(std::span{text.data(), text.size()});
}

}  // namespace

const char* to_string(Opcode opcode) noexcept {
  constexpr std::array<const char*, 16> names{
      "record",   "header",         "footer",         "schema",     "channel",          "message",
      "chunk",    "message_index",  "chunk_index",    "attachment", "attachment_index", "statistics",
      "metadata", "metadata_index", "summary_offset", "data_end"};
  const auto number = static_cast<std::size_t>(opcode);
  return number < names.size() ? names[number] : names[0];
}

void FieldWriter::text(std::string_view text) {
  number(static_cast<std::uint32_t>(text.size()));
  bytes_of(record::bytes_of(text));
}

void FieldWriter::texts(const Texts& texts) {
  const std::size_t begun = begin<std::uint32_t>();
  for (const auto& [name, value] : texts) {
    text(name);
    text(value);
  }
  end<std::uint32_t>(begun);
}

void put(FieldWriter& out, const Schema& schema) {
  const std::size_t begun = out.begin(Opcode::schema);
  out.number(schema.id);
  out.text(schema.name);
  out.text(schema.encoding);
  out.text(schema.data);
  out.end(begun);
}

void put(FieldWriter& out, const Channel& channel) {
  const std::size_t begun = out.begin(Opcode::channel);
  out.number(channel.id);
  out.number(channel.schema);
  out.text(channel.topic);
  out.text(channel.encoding);
  out.texts(channel.metadata);
  out.end(begun);
}

std::string to_string(const McapFault& fault) {
  return fmt::format("at byte {}, {}: {}", fault.offset, fault.field, fault.text);
}

ByteView FieldReader::take(const char* field, std::uint64_t size) {
  if (missing_ != nullptr || size > bytes_.size() - at_) {
    if (missing_ == nullptr) {
      missing_ = field;
      wanted_ = size;
    }
    return {};
  }
  const ByteView taken = bytes_.subspan(at_, static_cast<std::size_t>(size));
  at_ += taken.size();
  return taken;
}

std::string FieldReader::text(const char* field) {
  const ByteView bytes = take(field, number<std::uint32_t>(field));
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

Texts FieldReader::texts(const char* field) {
  const std::uint32_t size = number<std::uint32_t>(field);
  const std::size_t from = at_;
  FieldReader inner{take(field, size)};
  Texts texts;
  while (!inner.rest().empty() && inner.missing() == nullptr) {
    std::string name = inner.text(field);
    texts.insert_or_assign(std::move(name), inner.text(field));
  }
  if (inner.missing() != nullptr && missing_ == nullptr) {
    missing_ = field;
    wanted_ = inner.wanted_;
    at_ = from + inner.at_;
  }
  return texts;
}

McapFault FieldReader::fault(Opcode of, std::uint64_t record) const {
  return {.offset = record + record_head_bytes + at_,
          .field = fmt::format("{}.{}", to_string(of), missing_ == nullptr ? "?" : missing_),
          .text = fmt::format("{} bytes wanted, the record has {} more", wanted_, bytes_.size() - at_)};
}

}  // namespace trestle::record
