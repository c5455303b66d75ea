#include "bridge/describe/write/arxml/xml.hpp"

#include <algorithm>

#include "bridge/documents/xml_text.hpp"

namespace trestle::describe::arxml_writer {

std::string escaped(std::string_view text) {
  std::string out;
  for (const char letter : documents::xml_text(text)) {
    if (letter == '\n' || letter == '\r' || letter == '\t') {
      out += "&#" + std::to_string(int{letter}) + ";";
    } else {
      out += letter;
    }
  }
  return out;
}

std::string short_name(std::string_view name) {
  std::string out;
  for (const char letter : name) {
    const bool is_letter = (letter >= 'a' && letter <= 'z') || (letter >= 'A' && letter <= 'Z');
    const bool is_digit = letter >= '0' && letter <= '9';
    if (out.empty() && !is_letter) {
      out = "n";
    }
    if (is_letter || is_digit) {
      out += letter;
    } else if (out.back() != '_') {
      out += '_';
    }
  }
  if (out.empty()) {
    out = "unnamed";
  }
  out.resize(std::min<std::size_t>(out.size(), 120));
  return out;
}

void Xml::open(std::string_view tag) {
  indent();
  text_ += '<';
  text_ += tag;
  text_ += ">\n";
  open_.emplace_back(tag);
}

void Xml::close() {
  const std::string tag = open_.back();
  open_.pop_back();
  indent();
  text_ += "</" + tag + ">\n";
}

void Xml::leaf(std::string_view tag, std::string_view text) {
  indent();
  const std::string name{tag};
  text_ += "<" + name + ">" + escaped(text) + "</" + name.substr(0, name.find(' ')) + ">\n";
}

void Xml::comment(std::string_view text) {
  indent();
  text_ += "<!-- ";
  text_ += text;
  text_ += " -->\n";
}

void Xml::reference(std::string_view tag, std::string_view dest, std::string_view path) {
  leaf(std::string{tag} + " DEST=\"" + std::string{dest} + "\"", path);
}

Packages::Package& Packages::at(std::string_view path) {
  Package* package = &root_;
  while (!path.empty()) {
    path.remove_prefix(path.front() == '/' ? 1 : 0);
    const std::size_t slash = std::min(path.find('/'), path.size());
    const std::string name{path.substr(0, slash)};
    path.remove_prefix(slash);
    package->names.insert(name);
    package = &package->inner[name];
  }
  return *package;
}

std::string Packages::unique(std::string_view package, std::string_view name) {
  Package& where = at(package);
  const std::string plain = short_name(name);
  if (where.names.insert(plain).second) {
    return plain;
  }
  int& number = where.next.try_emplace(plain, 2).first->second;
  for (;; ++number) {
    std::string candidate = plain + (plain.ends_with('_') ? "" : "_") + std::to_string(number);
    if (where.names.insert(candidate).second) {
      return candidate;
    }
  }
}

void Packages::add(std::string_view package, std::string_view name, std::string element) {
  Package& where = at(package);
  where.names.insert(std::string{name});
  where.elements[std::string{name}] = std::move(element);
}

bool Packages::has(std::string_view package, std::string_view name) const {
  return const_cast<Packages*>(this)->at(package).names.contains(std::string{name});
}

void Packages::write(const Package& package, Xml& xml) {
  if (!package.elements.empty()) {
    xml.open("ELEMENTS");
    for (const auto& [name, element] : package.elements) {
      xml.raw(element);
    }
    xml.close();
  }
  if (!package.inner.empty()) {
    xml.open("AR-PACKAGES");
    for (const auto& [name, inner] : package.inner) {
      xml.open("AR-PACKAGE");
      xml.leaf("SHORT-NAME", name);
      write(inner, xml);
      xml.close();
    }
    xml.close();
  }
}

std::string Packages::text() const {
  Xml xml;
  write(root_, xml);
  return "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n"
         "<AUTOSAR xmlns=\"http://autosar.org/schema/r4.0\" "
         "xmlns:xsi=\"http://www.w3.org/2001/XMLSchema-instance\" "
         "xsi:schemaLocation=\"http://autosar.org/schema/r4.0 AUTOSAR_00051.xsd\">\n" +
         xml.text() + "</AUTOSAR>\n";
}

}  // namespace trestle::describe::arxml_writer
