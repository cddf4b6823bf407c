# `cpack` makes a .deb for Debian 12. deploy/package.sh is the whole way: it also makes the .tar.gz, which is this installation with libraries of
# its own, and sets the time that makes both the same each time.
include(GNUInstallDirs)
install(TARGETS cordillera RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR})
install(FILES ${CMAKE_BINARY_DIR}/share/egm96-15.pgm DESTINATION ${CMAKE_INSTALL_DATADIR}/cordillera)
# The viewer is there only where npm was; the server's page says so otherwise.
install(DIRECTORY ${CMAKE_BINARY_DIR}/share/web DESTINATION ${CMAKE_INSTALL_DATADIR}/cordillera OPTIONAL PATTERN complete EXCLUDE)
install(FILES README.md CHANGELOG.md SECURITY.md LICENSE deploy/DEPENDENCIES.md deploy/UPGRADE.md deploy/nginx.conf deploy/grafana.json
        DESTINATION ${CMAKE_INSTALL_DOCDIR} OPTIONAL)
install(DIRECTORY docs DESTINATION ${CMAKE_INSTALL_DOCDIR} OPTIONAL)
install(FILES deploy/cordillera.service DESTINATION lib/systemd/system OPTIONAL)
install(FILES deploy/cordillera.conf DESTINATION ${CMAKE_INSTALL_DATADIR}/cordillera OPTIONAL)

set(CPACK_PACKAGE_NAME cordillera)
set(CPACK_PACKAGE_VENDOR Cordillera)
set(CPACK_PACKAGE_DESCRIPTION_SUMMARY "${PROJECT_DESCRIPTION}")
set(CPACK_PACKAGE_CONTACT "The Cordillera authors <cordillera@localhost>")
set(CPACK_RESOURCE_FILE_LICENSE ${CMAKE_SOURCE_DIR}/LICENSE)
set(CPACK_GENERATOR DEB)
# Without the component dev (deploy/library).
set(CPACK_INSTALL_CMAKE_PROJECTS "${CMAKE_BINARY_DIR};${PROJECT_NAME};Unspecified;/")
set(CPACK_STRIP_FILES ON)
set(CPACK_THREADS 1)  # compressors cut their input by threads
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_SECTION science)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON)
# PROJ's database and tables; no library says so.
set(CPACK_DEBIAN_PACKAGE_DEPENDS proj-data)
set(CPACK_DEBIAN_PACKAGE_HOMEPAGE "")
include(CPack)
