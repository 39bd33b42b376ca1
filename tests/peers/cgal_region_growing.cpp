// Planes by CGAL's region growing on the nodes of range images.
//
// cgal_region_growing NEIGHBOURS DISTANCE_MM ANGLE_DEG LEAST_NODES (IMAGE LABELS)...
#include <CGAL/Shape_detection/Region_growing/Region_growing.h>
#include <CGAL/Shape_detection/Region_growing/Region_growing_on_point_set.h>
#include <CGAL/Simple_cartesian.h>
#include <CGAL/jet_estimate_normals.h>
#include <CGAL/pca_estimate_normals.h>
#include <CGAL/property_map.h>

#include <chrono>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <iterator>
#include <utility>
#include <vector>

using Kernel = CGAL::Simple_cartesian<double>;
using Node = std::pair<Kernel::Point_3, Kernel::Vector_3>;
using Nodes = std::vector<Node>;
using Points = CGAL::First_of_pair_property_map<Node>;
using Normals = CGAL::Second_of_pair_property_map<Node>;
using Neighbours = CGAL::Shape_detection::Point_set::K_neighbor_query<Kernel, Nodes, Points>;
using Planes =
    CGAL::Shape_detection::Point_set::Least_squares_plane_fit_region<Kernel, Nodes, Points, Normals>;
using Growing = CGAL::Shape_detection::Region_growing<Nodes, Neighbours, Planes>;

int main(int count, char **words) {
  if (count < 7 || count % 2 == 0) {
    std::fprintf(stderr, "usage: %s NEIGHBOURS DISTANCE_MM ANGLE_DEG LEAST_NODES (IMAGE LABELS)...\n",
                 words[0]);
    return 2;
  }
  const std::size_t neighbours = std::strtoul(words[1], nullptr, 10);
  const double distance_mm = std::atof(words[2]);
  const double angle_deg = std::atof(words[3]);
  const std::size_t least = std::strtoul(words[4], nullptr, 10);
  for (int k = 5; k < count; k += 2) {
    std::ifstream in(words[k], std::ios::binary);
    std::int64_t size[2] = {0, 0};
    in.read(reinterpret_cast<char *>(size), sizeof size);
    std::vector<double> xyz(3 * size[0] * size[1]);
    in.read(reinterpret_cast<char *>(xyz.data()), xyz.size() * sizeof(double));
    if (!in) {
      std::fprintf(stderr, "cannot read %s\n", words[k]);
      return 1;
    }
    Nodes nodes;
    std::vector<std::size_t> place;
    for (std::size_t n = 0; n < xyz.size() / 3; ++n) {
      if (!std::isnan(xyz[3 * n + 2])) {
        nodes.emplace_back(Kernel::Point_3(xyz[3 * n], xyz[3 * n + 1], xyz[3 * n + 2]),
                           Kernel::Vector_3(0, 0, 1));
        place.push_back(n);
      }
    }
    std::vector<std::uint16_t> labels(xyz.size() / 3, 0);
    const auto started = std::chrono::steady_clock::now();
    CGAL::pca_estimate_normals<CGAL::Sequential_tag>(
        nodes, static_cast<unsigned>(neighbours),
        CGAL::parameters::point_map(Points()).normal_map(Normals()));
    Neighbours query(nodes, neighbours, Points());
    Planes planes(nodes, distance_mm, angle_deg, least, Points(), Normals());
    Growing growing(nodes, query, planes);
    std::vector<std::vector<std::size_t>> regions;
    growing.detect(std::back_inserter(regions));
    const std::chrono::duration<double> taken = std::chrono::steady_clock::now() - started;
    for (std::size_t r = 0; r < regions.size(); ++r) {
      for (std::size_t n : regions[r]) {
        labels[place[n]] = static_cast<std::uint16_t>(r + 1);
      }
    }
    std::ofstream out(words[k + 1], std::ios::binary);
    out.write(reinterpret_cast<const char *>(labels.data()), labels.size() * sizeof(std::uint16_t));
    if (!out) {
      std::fprintf(stderr, "cannot write %s\n", words[k + 1]);
      return 1;
    }
    std::printf("%s %.6f\n", words[k], taken.count());
  }
}
