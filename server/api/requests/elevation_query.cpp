#include "server/api/requests/elevation_query.h"

#include <cmath>
#include <string>
#include <string_view>

#include "proto/numbers.h"
#include "server/http/json.h"
#include "server/options/table_reader.h"

namespace cordillera::server {
namespace {

using raster::LinePoint;

constexpr const char* kPlaceText = "lon,lat;lon,lat;... in degrees: longitudes -180 to 180, latitudes -90 to 90";
constexpr const char* kBodyText =
    R"({"points": [[lon, lat], ...]}, {"line": [[lon, lat], ...]}, or a GeoJSON Point, MultiPoint or LineString; )"
    "level and samples go with the query";

std::string as_given(std::string_view text) { return std::string(1, '\'').append(text.substr(0, 60)).append(1, '\''); }

bool on_earth(double longitude_deg, double latitude_deg) {
  return std::abs(longitude_deg) <= 180 && std::abs(latitude_deg) <= 90;
}

proto::Problem invalid_json(const std::string& what, const std::string& parameter = "") {
  return {"json-invalid", what, kBodyText, parameter};
}

std::string no_place(const std::string& parameter, std::size_t before, std::string_view text) {
  return parameter + ": place " + std::to_string(before + 1) + ", " + as_given(text) + ", is no place";
}

proto::Problem too_many(const std::string& parameter) {
  return {"option-invalid", parameter + " has more than " + std::to_string(kMostPlaces) + " places",
          "at most " + std::to_string(kMostPlaces) + " in a request", parameter};
}

/// "lon,lat;lon,lat"
proto::Result<std::vector<LinePoint>> places_of(std::string_view text, const std::string& parameter) {
  std::vector<LinePoint> places;
  for (bool more = true; more;) {
    const std::size_t end = text.find(';');
    const std::string_view place = text.substr(0, end);
    more = end != text.npos;
    text.remove_prefix(more ? end + 1 : text.size());
    const std::size_t comma = place.find(',');
    const auto longitude = proto::number<double>(place.substr(0, comma));
    const auto latitude = comma == place.npos ? std::nullopt : proto::number<double>(place.substr(comma + 1));
    if (!longitude || !latitude || !on_earth(*longitude, *latitude)) {
      return proto::Problem{"option-invalid", no_place(parameter, places.size(), place), kPlaceText, parameter};
    }
    places.push_back({*longitude, *latitude});
    if (places.size() > kMostPlaces) return too_many(parameter);
  }
  return places;
}

/// [[lon, lat], ...]; a third number, GeoJSON's height, is not read.
proto::Result<std::vector<LinePoint>> places_of(const Json& list, const std::string& parameter) {
  if (!list.is_array() || list.empty()) return invalid_json(parameter + " is no list of places", parameter);
  if (list.size() > kMostPlaces) return too_many(parameter);
  std::vector<LinePoint> places;
  for (const Json& place : list) {
    const bool pair = place.is_array() && place.size() >= 2 && place[0].is_number() && place[1].is_number();
    if (!pair || !on_earth(place[0].get<double>(), place[1].get<double>())) {
      const std::string text = place.dump(-1, ' ', false, Json::error_handler_t::replace);
      return proto::Problem{"json-invalid", no_place(parameter, places.size(), text),
                            "[longitude, latitude] in degrees, -180 to 180 and -90 to 90", parameter};
    }
    places.push_back({place[0].get<double>(), place[1].get<double>()});
  }
  return places;
}

struct Shape {
  std::vector<LinePoint> places;
  bool line = false;
};

proto::Result<Shape> shape_of(const Json& list, const std::string& parameter, bool line) {
  auto places = places_of(list, parameter);
  if (!places) return places.problem();
  return Shape{std::move(*places), line};
}

/// Of an object that has a type.
proto::Result<Shape> geometry(const Json& json) {
  const std::string type = json["type"].is_string() ? json["type"].get<std::string>() : "";
  const Json coordinates = json.value("coordinates", Json());
  if (type == "Point") return shape_of(Json::array({coordinates}), "coordinates", false);
  if (type == "MultiPoint" || type == "LineString") return shape_of(coordinates, "coordinates", type == "LineString");
  return invalid_json("the GeoJSON type " + as_given(type) + " has no elevations", "type");
}

proto::Result<Shape> shape_of_body(const Request& request) {
  if (request.header("content-type").value_or("").rfind("multipart/", 0) == 0)
    return invalid_json("the body is a multipart form; the JSON itself is wanted, with nothing around it");
  std::string body;
  const bool whole = request.read_body && request.read_body([&](std::string_view piece) {
    body.append(piece);
    return body.size() <= kMostQueryBytes;
  });
  if (body.size() > kMostQueryBytes) {
    return proto::Problem{"body-too-large", "the body of an elevation query is larger than this service takes",
                          "at most " + std::to_string(kMostQueryBytes >> 10) + " KiB, " + std::to_string(kMostPlaces) + " places",
                          ""};
  }
  if (!whole) return proto::Problem{"body-incomplete", "the body ended before its end", "the whole body", ""};
  const Json json = pipeline::json_of_stranger(body);
  if (!json.is_object()) return invalid_json(std::string("the body is no JSON object ") + pipeline::kStrangeJson);
  const Json inner = json.value("type", Json()) == "Feature" ? json.value("geometry", Json()) : json;
  if (!inner.is_object()) return invalid_json("the Feature has no geometry", "geometry");
  if (inner.contains("type")) return geometry(inner);
  if (json.size() == 1 && json.contains("points")) return shape_of(json["points"], "points", false);
  if (json.size() == 1 && json.contains("line")) return shape_of(json["line"], "line", true);
  return invalid_json("the body names neither points nor a line, or something else beside them");
}

/// What the query says.
struct AskedWords {
  std::optional<std::string> points, line;
  std::optional<std::uint32_t> samples, level;
};

std::vector<OptionOf<AskedWords>> elevation_words(WholeRange levels) {
  const auto text = [](std::optional<std::string> AskedWords::*word) {
    return [word](std::string_view said, AskedWords& words) { return (words.*word).emplace(said), Complaint(); };
  };
  const auto number = [](std::optional<std::uint32_t> AskedWords::*word) {
    return [word](AskedWords& words) -> std::uint32_t& { return (words.*word).emplace(); };
  };
  return {{"points", "PLACES", "places, one by one", kPlaceText, text(&AskedWords::points)},
          {"line", "PLACES", "a line through places", kPlaceText, text(&AskedWords::line)},
          whole_number<AskedWords>("samples", "N", "places along the line", {2, kMostPlaces}, number(&AskedWords::samples)),
          whole_number<AskedWords>("level", "LEVEL", "of the dataset", levels, number(&AskedWords::level))};
}

proto::Result<Shape> shape_of(const Request& request, const AskedWords& words) {
  const bool posted = request.method == "POST";
  if (posted && (words.points || words.line)) {
    return proto::Problem{"options-conflict", "places stand in the query of a POST", "places in its body, or a GET",
                          words.points ? "points" : "line"};
  }
  if (posted) return shape_of_body(request);
  if (words.points.has_value() == words.line.has_value()) {
    const char* slug = words.points ? "options-conflict" : "option-invalid";
    return proto::Problem{slug, "exactly one of points and line is wanted", kPlaceText, "points"};
  }
  auto places = places_of(std::string_view(words.points ? *words.points : *words.line), words.points ? "points" : "line");
  if (!places) return places.problem();
  return Shape{std::move(*places), words.line.has_value()};
}

}  // namespace

proto::Result<ElevationQuery> elevation_query(const Request& request, int least_level, int most_level) {
  const WholeRange levels{static_cast<std::uint32_t>(least_level), static_cast<std::uint32_t>(most_level)};
  AskedWords words;
  if (auto problem = read_options(elevation_words(levels), request.query, {}, words)) return *problem;
  ElevationQuery query;
  if (words.level) query.level = static_cast<int>(*words.level);
  auto shape = shape_of(request, words);
  if (!shape) return shape.problem();
  if (words.samples && (!shape->line || shape->places.size() < 2)) {
    return proto::Problem{"options-conflict", "samples are places along a line, and there is none",
                          "samples with a line of two places or more", "samples"};
  }
  query.line = shape->line;
  query.places = query.line ? raster::along_geodesics(shape->places, words.samples.value_or(0)) : std::move(shape->places);
  return query;
}

}  // namespace cordillera::server
