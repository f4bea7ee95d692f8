#include "base/tls/pem.h"

#include <openssl/bio.h>
#include <openssl/err.h>
#include <openssl/pem.h>
#include <openssl/x509.h>

#include <memory>

namespace hypermap::tls {
namespace {

template <auto free>
struct FreedBy {
  template <typename T>
  void operator()(T* object) const {
    free(object);
  }
};
using Bio = std::unique_ptr<BIO, FreedBy<BIO_free>>;
using Certificate = std::unique_ptr<X509, FreedBy<X509_free>>;
using Key = std::unique_ptr<EVP_PKEY, FreedBy<EVP_PKEY_free>>;

// Reads from `pem`, which must outlive the result.
Bio Open(const std::string& pem) {
  return Bio(BIO_new_mem_buf(pem.data(), static_cast<int>(pem.size())));
}

// Null if the text contains no certificate.
Certificate FirstCertificate(const std::string& pem) {
  return Certificate(PEM_read_bio_X509(Open(pem).get(), nullptr, nullptr, nullptr));
}

// Callback for encrypted keys. Without it OpenSSL asks for the password at the terminal.
int NoPassword(char* /*buffer*/, int /*size*/, int /*writing*/, void* /*data*/) { return -1; }

// Also clears OpenSSL's error queue: gRPC's next call on this thread would find the error there.
absl::Status Wrong(const char* what) {
  ERR_clear_error();
  return absl::InvalidArgumentError(what);
}

}  // namespace

absl::Status CheckCertificates(const std::string& pem) {
  return FirstCertificate(pem) ? absl::OkStatus() : Wrong("holds no certificate in PEM");
}

absl::Status CheckKey(const std::string& pem, const std::string& certificates) {
  const Key key(PEM_read_bio_PrivateKey(Open(pem).get(), nullptr, NoPassword, nullptr));
  if (!key) return Wrong("holds no private key in PEM that is not encrypted");
  const Certificate certificate = FirstCertificate(certificates);
  if (X509_check_private_key(certificate.get(), key.get()) != 1) {
    return Wrong("is not the key of the certificate");
  }
  return absl::OkStatus();
}

}  // namespace hypermap::tls
