#include "raster/disk/share_folder.h"

#include <cstdlib>
#include <string>

namespace cordillera::raster {
namespace {

namespace fs = std::filesystem;

// Where systems keep the certificates that they trust, as one file: Debian and Arch, Fedora, newer Red Hat, openSUSE.
constexpr const char* kTrusted[] = {"/etc/ssl/certs/ca-certificates.crt", "/etc/pki/tls/certs/ca-bundle.crt",
                                    "/etc/pki/ca-trust/extracted/pem/tls-ca-bundle.pem", "/etc/ssl/ca-bundle.pem"};

void use_private_tables(const std::string& own) {
  const char* given = std::getenv("PROJ_DATA");
  const std::string others = given == nullptr ? "" : given;
  if (others != own && !others.starts_with(own + ":"))
    setenv("PROJ_DATA", (others.empty() ? own : own + ":" + others).c_str(), 1);
  setenv("GDAL_DRIVER_PATH", "disable", 1);  // plugins of the machine's GDAL are not for this one
}

/// For OpenSSL and, by GDAL, for curl.
void use_certificates_of_the_machine() {
  if (std::getenv("SSL_CERT_FILE") != nullptr || std::getenv("SSL_CERT_DIR") != nullptr) return;
  std::error_code error;
  for (const char* file : kTrusted) {
    if (!fs::is_regular_file(file, error)) continue;
    setenv("SSL_CERT_FILE", file, 1);
    return;
  }
}

}  // namespace

fs::path share_folder() {
  std::error_code error;
  return fs::read_symlink("/proc/self/exe", error).parent_path().parent_path() / "share";
}

void fit_private_libraries() {
  std::error_code error;
  const std::string own = share_folder() / "cordillera" / "proj";
  if (!fs::is_regular_file(own + "/proj.db", error)) return;
  use_private_tables(own);
  use_certificates_of_the_machine();
}

}  // namespace cordillera::raster
