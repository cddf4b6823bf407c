#!/usr/bin/env python3
"""includes.py on made trees: each rule is broken once, and must be found."""
import os
import tempfile
import unittest

import includes

# A tree that keeps every rule. The broken ones are this and one more line.
GOOD = {
    "proto/mesh.h": "#pragma once\n#include <cstdint>\n",
    "raster/source.h": '#include "cordillera.pb.h"\n#include "proto/mesh.h"\n',
    "raster/dataset.cpp": '#include <gdal_priv.h>\n#include <cpl_string.h>\n#include "raster/source.h"\n',
    "gpu/collapse/waves.h": '#include "proto/mesh.h"\n',
    "gpu/fit/plan.h": '#include "gpu/collapse/waves.h"\n',
    "gpu/cleap/cleap.h": '#include "gpu/fit/plan.h"\n',
    "gpu/waves.cu": '#include <cuda_runtime.h>\n#include <cub/cub.cuh>\n#include "gpu/collapse/waves.h"\n',
    "pipeline/build/build.h": '#include "gpu/collapse/waves.h"\n#include "raster/source.h"\n',
    "pipeline/encode/draco_encode.cpp": '#include <draco/compression/encode.h>\n',
    "pipeline/store/sqlite.cpp": "#include <sqlite3.h>\n",
    "pipeline/threads/workers.cpp": "#include <boost/asio/post.hpp>\n",
    "server/client/connection.cpp": '#include <httplib.h>\n#include <sys/socket.h>\n#include "pipeline/build/build.h"\n',
    "server/web/node_modules/addon/addon.cpp": '#include "anything.h"\n',
    "tests/raster/fixture.cpp": '#include <gdal_priv.h>\n#include "server/http.h"\n',
}


def made_tree(root, files):
    for path, text in files.items():
        os.makedirs(os.path.dirname(os.path.join(root, path)), exist_ok=True)
        with open(os.path.join(root, path), "w", encoding="utf-8") as file:
            file.write(text)


class Includes(unittest.TestCase):
    def findings(self, more=None):
        files = dict(GOOD)
        for path, line in (more or {}).items():
            files[path] = files.get(path, "") + line + "\n"
        with tempfile.TemporaryDirectory() as root:
            made_tree(root, files)
            return includes.findings(root)

    def found(self, path, line, words):
        """The line, put at the end of the file at path, is the one thing found, and the finding says the words."""
        found, _ = self.findings({path: line})
        at = f"{path}:{GOOD.get(path, '').count(chr(10)) + 1}: "
        self.assertEqual(len(found), 1, f"{line} in {path}: {found}")
        self.assertTrue(found[0].startswith(at), found[0])
        self.assertIn(words, found[0])

    def test_a_good_tree(self):
        found, seen = self.findings()
        self.assertEqual(found, [])
        self.assertEqual(seen, sum(text.count("#include") for path, text in GOOD.items() if "node_modules" not in path and path[:5] != "tests"))

    def test_second_products_stay_apart(self):
        for path in ("gpu/collapse/waves.h", "pipeline/build/build.h"):
            for header in ("gpu/fit/plan.h", "gpu/cleap/cleap.h"):
                self.found(path, f'#include "{header}"', "is a product of its own")
        self.found("gpu/fit/plan.h", '#include "gpu/cleap/cleap.h"', "gpu/cleap is a product of its own")
        self.assertEqual(self.findings({"server/client/connection.cpp": '#include "gpu/cleap/cleap.h"\n#include "gpu/fit/plan.h"'})[0], [])

    def test_nothing_to_look_at(self):
        with tempfile.TemporaryDirectory() as root:
            self.assertEqual(includes.findings(root), ([], 0))

    def test_includes_only_go_down(self):
        for path, header in [
            ("proto/mesh.h", "raster/source.h"), ("proto/mesh.h", "gpu/collapse/waves.h"), ("proto/mesh.h", "pipeline/build/build.h"),
            ("raster/source.h", "gpu/collapse/waves.h"), ("raster/source.h", "pipeline/build/build.h"), ("raster/source.h", "server/http.cpp"),
            ("gpu/collapse/waves.h", "raster/source.h"), ("gpu/waves.cu", "pipeline/build/build.h"), ("gpu/inner/deep.inl", "raster/source.h"),
            ("pipeline/build/build.h", "server/http.cpp"),
        ]:
            self.found(path, f'#include "{header}"', "includes only go down")
            self.found(path, f"#  include <{header}>", "includes only go down")

    def test_nothing_looks_into_the_tests(self):
        self.found("server/http.cpp", '#include "tests/raster/fixture.cpp"', "does not look into tests")

    def test_paths_start_at_the_root(self):
        self.found("gpu/waves.cu", '#include "waves.h"', "root")
        self.found("gpu/waves.cu", '#include "../raster/source.h"', "does not look into ..")
        self.found("gpu/waves.cu", '#include "gpu/gone.h"', "no such file")

    def test_gpu_builds_without_protobuf(self):
        self.found("gpu/collapse/waves.h", '#include "cordillera.pb.h"', "without protobuf")
        self.found("proto/mesh.h", '#include "cordillera.pb.h"', "without protobuf")

    def test_packages_stay_at_home(self):
        for header, paths in [
            ("httplib.h", ["server/api/api.cpp", "server/http.h", "pipeline/build/build.h"]),
            ("gdal.h", ["pipeline/build/build.h", "server/http.cpp", "gpu/collapse/waves.h"]),
            ("gdal_priv.h", ["pipeline/build/build.h"]),
            ("ogr_spatialref.h", ["server/http.cpp"]),
            ("cpl_conv.h", ["proto/mesh.h"]),
            ("GeographicLib/Geoid.hpp", ["pipeline/build/build.h"]),
            ("draco/mesh/mesh.h", ["pipeline/build/build.h", "server/draco_x.cpp"]),
            ("cuda_runtime.h", ["gpu/collapse/waves.h", "gpu/collapse/waves.cpp", "pipeline/build/build.h"]),
            ("cub/device/device_scan.cuh", ["gpu/collapse/waves.h"]),
            ("sqlite3.h", ["pipeline/build/build.h", "server/http.cpp"]),
            ("boost/asio.hpp", ["pipeline/build/build.h", "server/http.cpp"]),
            ("boost/asio/post.hpp", ["gpu/collapse/waves.h"]),
            ("openssl/sha.h", ["server/http.cpp"]),
            ("google/protobuf/message.h", ["gpu/collapse/waves.h", "server/http.cpp"]),
            ("nlohmann/json.hpp", ["server/api/api.cpp"]),
            ("spdlog/spdlog.h", ["server/http.cpp"]),
            ("CLI/CLI.hpp", ["server/http.cpp"]),
        ]:
            for path in paths:
                self.found(path, f"#include <{header}>", "stays in")
                self.found(path, f'#include "{header}"', "stays in")

    def test_a_new_package_needs_a_home(self):
        for header in ["Eigen/Dense", "bzlib.h", "tbb/parallel_for.h", "boost/container/flat_map.hpp"]:
            self.found("pipeline/build/build.h", f"#include <{header}>", "has no home")

    def test_comments_are_not_includes(self):
        for line in ["// #include <gdal.h>", "/*\n#include <gdal.h>\n*/"]:
            self.assertEqual(self.findings({"server/http.cpp": line})[0], [])
        self.found("server/http.cpp", "#include <gdal.h>  // not /* here", "stays in")


if __name__ == "__main__":
    unittest.main()
