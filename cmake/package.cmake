# `cpack` makes a .deb for Debian 12. deploy/package.sh is the whole way: it also makes the .tar.gz, which is this installation with libraries of
# its own, and sets the time that makes both the same each time.
include(GNUInstallDirs)
install(TARGETS cordillera RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR})
install(FILES ${CMAKE_BINARY_DIR}/share/egm96-15.pgm DESTINATION ${CMAKE_INSTALL_DATADIR}/cordillera)
# The viewer is there only where npm was; the server's page says so otherwise.
install(DIRECTORY ${CMAKE_BINARY_DIR}/share/web DESTINATION ${CMAKE_INSTALL_DATADIR}/cordillera OPTIONAL PATTERN complete EXCLUDE)
# Pages, and the files that they lead to, lie as in the tree, so that links and lines of the pages hold: tests/deploy/installed_pages.sh
# follows them. READMEs of the floors and of measurements are among them, and scripts for clusters with their modes.
file(GLOB_RECURSE pages RELATIVE ${CMAKE_SOURCE_DIR} CONFIGURE_DEPENDS
  ${CMAKE_SOURCE_DIR}/docs/* ${CMAKE_SOURCE_DIR}/deploy/*.md ${CMAKE_SOURCE_DIR}/gpu/*.md ${CMAKE_SOURCE_DIR}/pipeline/*.md
  ${CMAKE_SOURCE_DIR}/proto/*.md ${CMAKE_SOURCE_DIR}/raster/*.md ${CMAKE_SOURCE_DIR}/server/*.md
  ${CMAKE_SOURCE_DIR}/tests/*.md ${CMAKE_SOURCE_DIR}/tests/bench/*.svg ${CMAKE_SOURCE_DIR}/tests/examples/installed/*)
list(FILTER pages EXCLUDE REGEX "node_modules/")
list(APPEND pages
  README.md CHANGELOG.md CONTRIBUTING.md GLOSSARY.md SECURITY.md LICENSE
  deploy/Dockerfile deploy/cordillera.conf deploy/cordillera.service deploy/cordillera.sysusers deploy/grafana.json deploy/nginx.conf deploy/stages.py
  deploy/library/include/cordillera/simplify.h deploy/library/include/cordillera/simplify.hpp gpu/fit/simplify_height_mesh.h
  tests/crash/client.py tests/examples/simplify_height_mesh.cpp tests/long.txt
  tests/server/sandbox/job_calls.tsv)
foreach(page ${pages})
  cmake_path(GET page PARENT_PATH folder)
  install(FILES ${page} DESTINATION ${CMAKE_INSTALL_DOCDIR}/${folder})
endforeach()
foreach(script slurm/submit.sh slurm/status.sh kubernetes/jobs.py kubernetes/run.sh aws-batch/jobs.py aws-batch/submit.sh)
  cmake_path(GET script PARENT_PATH folder)
  install(PROGRAMS deploy/${script} DESTINATION ${CMAKE_INSTALL_DOCDIR}/deploy/${folder})
endforeach()
install(FILES deploy/cordillera.service DESTINATION lib/systemd/system)
install(FILES deploy/cordillera.sysusers DESTINATION lib/sysusers.d RENAME cordillera.conf)
install(FILES deploy/cordillera.conf DESTINATION ${CMAKE_INSTALL_DATADIR}/cordillera)

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
# Makes the user of the unit.
set(CPACK_DEBIAN_PACKAGE_CONTROL_EXTRA ${CMAKE_SOURCE_DIR}/deploy/debian/postinst)
set(CPACK_DEBIAN_PACKAGE_CONTROL_STRICT_PERMISSION ON)
include(CPack)
