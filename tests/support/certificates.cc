#include "tests/support/certificates.h"

#include <cstdlib>
#include <fstream>
#include <iterator>
#include <stdexcept>

namespace hypermap::testing {
namespace {

// Makes a key and a certificate that is valid for a day.
void Make(const TemporaryFolder& folder, const std::string& name, const std::string& more) {
  const std::string command =
      "openssl req -x509 -newkey ec -pkeyopt ec_paramgen_curve:prime256v1 -noenc -days 1 -subj "
      "/CN=" +
      name + " -keyout " + folder / (name + ".key") + " -out " + folder / (name + ".pem") + more +
      " 2>" + folder / "openssl.log";
  if (std::system(command.c_str()) == 0) return;
  throw std::runtime_error(command + ": " + Contents(folder / "openssl.log"));
}

}  // namespace

CertificateAuthority::CertificateAuthority(const TemporaryFolder& folder, const std::string& name)
    : folder_(folder), name_(name) {
  Make(folder, name, "");
}

void CertificateAuthority::Sign(const std::string& name,
                                const std::string& alternative_names) const {
  Make(folder_, name,
       " -CA " + folder_ / (name_ + ".pem") + " -CAkey " + folder_ / (name_ + ".key") +
           " -addext subjectAltName=" + alternative_names +
           " -addext basicConstraints=critical,CA:FALSE");
}

std::string Contents(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

}  // namespace hypermap::testing
