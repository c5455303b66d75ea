#include "bridge/record/mcap_writer.hpp"

#include <unistd.h>

#include <cassert>
#include <utility>

#include "bridge/record/mcap_fields.hpp"
#include "someip/core/e2e/crc.hpp"

namespace trestle::record {
namespace {

ByteView magic() {
  return std::as_bytes(std::span{mcap_magic});
}

}  // namespace

McapWriter::McapWriter(const std::string& path, McapSettings settings)
    : file_{path}, settings_{std::move(settings)}, compressor_{settings_.compression} {
  std::vector<std::byte> head;
  FieldWriter out{head};
  out.bytes_of(magic());
  const std::size_t begun = out.begin(Opcode::header);
  out.text(settings_.profile);
  out.text(settings_.library);
  out.end(begun);
  if (const std::error_code error = file_.append(head)) {
    ::unlink(path.c_str());  // so that it can be tried again
    throw std::system_error{error, "cannot write " + path};
  }
}

void McapWriter::add(Schema schema) {
  const std::uint16_t id = schema.id;
  assert(id != 0 && !schemas_.contains(id));
  schemas_.emplace(id, KnownSchema{.schema = std::move(schema)});
}

void McapWriter::add(Channel channel) {
  const std::uint16_t id = channel.id;
  assert(!channels_.contains(id) && (channel.schema == 0 || schemas_.contains(channel.schema)));
  channels_.emplace(id, Known{.channel = std::move(channel)});
}

/// Whoever reads from the front finds both before the first message.
void McapWriter::begin_channel(Known& known) {
  FieldWriter out{chunk_};
  if (known.channel.schema != 0) {
    KnownSchema& schema = schemas_.at(known.channel.schema);
    if (!schema.is_written && !std::exchange(schema.is_pending, true)) {
      put(out, schema.schema);
    }
  }
  put(out, known.channel);
  known.is_pending = true;
}

std::error_code McapWriter::write(const Entry& message) {
  Known& known = channels_.at(message.channel);
  if (!known.is_written && !known.is_pending) {
    begin_channel(known);
  }
  known.index.push_back({message.log_time, chunk_.size()});
  FieldWriter out{chunk_};
  const std::size_t begun = out.begin(Opcode::message);
  out.number(message.channel);
  out.number(message.sequence);
  out.number(message.log_time);
  out.number(message.publish_time);
  out.bytes_of(message.data);
  out.end(begun);
  pending_.add(message);
  return chunk_.size() >= settings_.chunk_bytes ? flush() : std::error_code{};
}

std::error_code McapWriter::flush() {
  if (pending_.messages == 0) {
    return {};
  }
  ChunkIndex index = put_chunk();
  const std::error_code error = file_.append(out_);
  if (!error) {
    chunks_.push_back(std::move(index));
  }
  end_chunk(!error);
  return error;
}

McapWriter::ChunkIndex McapWriter::put_chunk() {
  out_.clear();
  FieldWriter out{out_};
  ChunkIndex index{.start = pending_.start,
                   .end = pending_.end,
                   .offset = file_.size(),
                   .compression = settings_.compression,
                   .uncompressed = chunk_.size()};
  const std::size_t begun = out.begin(Opcode::chunk);
  out.number(index.start);
  out.number(index.end);
  out.number(index.uncompressed);
  out.number(someip::e2e::crc32(chunk_));
  const std::size_t name = out_.size();
  out.text(in_file(settings_.compression));
  std::size_t records = out.begin<std::uint64_t>();
  if (!compressor_.add(chunk_, out_)) {
    out_.resize(name);
    index.compression = Compression::none;
    out.text(in_file(index.compression));
    records = out.begin<std::uint64_t>();
    out.bytes_of(chunk_);
  }
  out.end(records);
  index.compressed = out_.size() - records;
  out.end(begun);
  index.bytes = out_.size();
  for (const auto& [id, known] : channels_) {
    if (known.index.empty()) {
      continue;
    }
    index.indexes.emplace(id, file_.size() + out_.size());
    const std::size_t one = out.begin(Opcode::message_index);
    out.number(id);
    const std::size_t entries = out.begin<std::uint32_t>();
    for (const Index& entry : known.index) {
      out.number(entry.time);
      out.number(entry.offset);
    }
    out.end<std::uint32_t>(entries);
    out.end(one);
  }
  index.index_bytes = out_.size() - index.bytes;
  return index;
}

void McapWriter::end_chunk(bool is_written) {
  for (auto& [id, known] : channels_) {
    if (is_written && !known.index.empty()) {
      statistics_.by_channel[id] += known.index.size();
    }
    known.is_written |= known.is_pending && is_written;
    known.is_pending = false;
    known.index.clear();
  }
  for (auto& [id, known] : schemas_) {
    known.is_written |= known.is_pending && is_written;
    known.is_pending = false;
  }
  if (is_written) {
    statistics_.start =
        statistics_.messages == 0 ? pending_.start : std::min(statistics_.start, pending_.start);
    statistics_.end = std::max(statistics_.end, pending_.end);
    statistics_.messages += pending_.messages;
    ++statistics_.chunks;
  } else {
    lost_ += pending_.messages;
  }
  pending_ = {};
  chunk_.clear();
}

std::error_code McapWriter::add_metadata(const std::string& name, const Texts& texts) {
  if (const std::error_code error = flush()) {
    return error;
  }
  std::vector<std::byte> bytes;
  FieldWriter out{bytes};
  const std::size_t begun = out.begin(Opcode::metadata);
  out.text(name);
  out.texts(texts);
  out.end(begun);
  const std::uint64_t offset = file_.size();
  const std::error_code error = file_.append(bytes);
  if (!error) {
    metadata_.push_back({offset, bytes.size(), name});
    ++statistics_.metadata;
  }
  return error;
}

std::error_code McapWriter::finish() {
  if (const std::error_code error = flush()) {
    return error;
  }
  std::vector<std::byte> bytes;
  put_summary(bytes);
  return file_.append(bytes);
}

void McapWriter::put_summary(std::vector<std::byte>& bytes) const {
  FieldWriter out{bytes};
  const std::size_t data_end = out.begin(Opcode::data_end);
  out.number(std::uint32_t{0});  // chunks have their own checksums
  out.end(data_end);

  const std::size_t summary = bytes.size();
  const auto place = [&] { return file_.size() + bytes.size(); };
  struct Group {
    Opcode of{};
    std::uint64_t offset = 0;
    std::uint64_t bytes = 0;
  };
  std::vector<Group> groups;
  const auto group = [&](Opcode of, const auto& put_all) {
    const std::uint64_t from = place();
    put_all();
    if (place() != from) {
      groups.push_back({of, from, place() - from});
    }
  };
  group(Opcode::schema, [&] {
    for (const auto& [id, known] : schemas_) {
      if (known.is_written) {
        put(out, known.schema);
      }
    }
  });
  group(Opcode::channel, [&] {
    for (const auto& [id, known] : channels_) {
      if (known.is_written) {
        put(out, known.channel);
      }
    }
  });
  group(Opcode::statistics, [&] {
    const auto count = [](const auto& all) {
      return std::ranges::count_if(all, [](const auto& one) { return one.second.is_written; });
    };
    const std::size_t begun = out.begin(Opcode::statistics);
    out.number(statistics_.messages);
    out.number(static_cast<std::uint16_t>(count(schemas_)));
    out.number(static_cast<std::uint32_t>(count(channels_)));
    out.number(std::uint32_t{0});  // attachments
    out.number(statistics_.metadata);
    out.number(statistics_.chunks);
    out.number(statistics_.start);
    out.number(statistics_.end);
    const std::size_t counts = out.begin<std::uint32_t>();
    for (const auto& [id, messages] : statistics_.by_channel) {
      out.number(id);
      out.number(messages);
    }
    out.end<std::uint32_t>(counts);
    out.end(begun);
  });
  group(Opcode::chunk_index, [&] {
    for (const ChunkIndex& one : chunks_) {
      const std::size_t begun = out.begin(Opcode::chunk_index);
      out.number(one.start);
      out.number(one.end);
      out.number(one.offset);
      out.number(one.bytes);
      const std::size_t offsets = out.begin<std::uint32_t>();
      for (const auto& [id, offset] : one.indexes) {
        out.number(id);
        out.number(offset);
      }
      out.end<std::uint32_t>(offsets);
      out.number(one.index_bytes);
      out.text(in_file(one.compression));
      out.number(one.compressed);
      out.number(one.uncompressed);
      out.end(begun);
    }
  });
  group(Opcode::metadata_index, [&] {
    for (const MetadataIndex& one : metadata_) {
      const std::size_t begun = out.begin(Opcode::metadata_index);
      out.number(one.offset);
      out.number(one.bytes);
      out.text(one.name);
      out.end(begun);
    }
  });
  const std::uint64_t offsets = place();
  for (const Group& one : groups) {
    const std::size_t begun = out.begin(Opcode::summary_offset);
    out.number(static_cast<std::uint8_t>(one.of));
    out.number(one.offset);
    out.number(one.bytes);
    out.end(begun);
  }
  // Its checksum is also over its own front, so that the length has to be there before it.
  out.number(static_cast<std::uint8_t>(Opcode::footer));
  out.number(footer_bytes);
  out.number(file_.size() + summary);
  out.number(offsets);
  out.number(someip::e2e::crc32(ByteView{bytes}.subspan(summary)));
  out.bytes_of(magic());
}

}  // namespace trestle::record
