#include "bridge/documents/xml_text.hpp"

namespace trestle::documents {

std::string xml_text(std::string_view text) {
  std::string all;
  for (const char c : text) {
    switch (c) {
      case '&':
        all += "&amp;";
        break;
      case '<':
        all += "&lt;";
        break;
      case '>':
        all += "&gt;";
        break;
      case '"':
        all += "&quot;";
        break;
      case '\n':
      case '\t':
      case '\r':
        all += c;
        break;
      default:
        all += static_cast<unsigned char>(c) < 0x20 ? '?' : c;
    }
  }
  return all;
}

}  // namespace trestle::documents
