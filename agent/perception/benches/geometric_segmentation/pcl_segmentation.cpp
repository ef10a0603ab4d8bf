// PCL's supervoxels and LCCP on one cloud, for comparison: how much CPU time they take, and the segments they find.
//
// Usage: pcl_segmentation CLOUD LABELS VOXEL SEED COLOUR SPATIAL NORMAL TOLERANCE_DEG K SANITY SMOOTHNESS SMALL REPEATS
// CLOUD holds, little endian: uint32 width, uint32 height, then for each point float x, y, z and uint32 0x00rrggbb;
// missing points are NaN. LABELS receives a uint32 a point (0 = none) twice over: supervoxels, then segments.
// SMOOTHNESS below nought leaves that criterion out. Prints one JSON object. Timed is all that a caller needs done,
// from the cloud in memory to the segment of each supervoxel, with both objects made anew each time.

#include <pcl/point_cloud.h>
#include <pcl/point_types.h>
#include <pcl/pcl_config.h>
#include <pcl/segmentation/lccp_segmentation.h>
#include <pcl/segmentation/supervoxel_clustering.h>

#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <fstream>
#include <iostream>
#include <map>
#include <vector>

using Point = pcl::PointXYZRGBA;

static double cpu_seconds() {
    timespec t{};
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
    return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
}

static pcl::PointCloud<Point>::Ptr read_cloud(const char *path) {
    std::ifstream in(path, std::ios::binary);
    std::uint32_t size[2];
    in.read(reinterpret_cast<char *>(size), sizeof size);
    pcl::PointCloud<Point>::Ptr cloud(new pcl::PointCloud<Point>(size[0], size[1]));
    for (auto &p : *cloud) {
        float xyz[3];
        std::uint32_t rgb;
        in.read(reinterpret_cast<char *>(xyz), sizeof xyz);
        in.read(reinterpret_cast<char *>(&rgb), sizeof rgb);
        p.x = xyz[0];
        p.y = xyz[1];
        p.z = xyz[2];
        p.rgba = rgb | 0xff000000u;
    }
    if (!in) {
        std::cerr << path << ": too short\n";
        std::exit(1);
    }
    cloud->is_dense = false;
    return cloud;
}

int main(int argc, char **argv) {
    if (argc != 14) {
        std::cerr << "13 arguments are expected, " << argc - 1 << " were given\n";
        return 2;
    }
    const auto cloud = read_cloud(argv[1]);
    const float voxel = std::stof(argv[3]), seed = std::stof(argv[4]);
    const float colour = std::stof(argv[5]), spatial = std::stof(argv[6]), normal = std::stof(argv[7]);
    const float tolerance = std::stof(argv[8]), smoothness = std::stof(argv[11]);
    const unsigned k = std::stoul(argv[9]), sanity = std::stoul(argv[10]), small = std::stoul(argv[12]);
    const int repeats = std::stoi(argv[13]);

    double best_supervoxels = 1e30, best_all = 1e30;
    std::vector<std::uint32_t> labels(2 * cloud->size());
    std::size_t supervoxels_found = 0;
    for (int i = 0; i < repeats; ++i) {
        const double start = cpu_seconds();
        pcl::SupervoxelClustering<Point> vccs(voxel, seed);
        vccs.setUseSingleCameraTransform(false);
        vccs.setInputCloud(cloud);
        vccs.setColorImportance(colour);
        vccs.setSpatialImportance(spatial);
        vccs.setNormalImportance(normal);
        std::map<std::uint32_t, pcl::Supervoxel<Point>::Ptr> supervoxels;
        vccs.extract(supervoxels);
        std::multimap<std::uint32_t, std::uint32_t> adjacency;
        vccs.getSupervoxelAdjacency(adjacency);
        const double middle = cpu_seconds();
        pcl::LCCPSegmentation<Point> lccp;
        lccp.setConcavityToleranceThreshold(tolerance);
        lccp.setKFactor(k);
        lccp.setSanityCheck(sanity != 0);
        lccp.setSmoothnessCheck(smoothness >= 0, voxel, seed, smoothness);
        lccp.setMinSegmentSize(small);
        lccp.setInputSupervoxels(supervoxels, adjacency);
        lccp.segment();
        std::map<std::uint32_t, std::uint32_t> segment_of;
        lccp.getSupervoxelToSegmentMap(segment_of);
        const double end = cpu_seconds();
        best_supervoxels = std::min(best_supervoxels, middle - start);
        best_all = std::min(best_all, end - start);
        supervoxels_found = supervoxels.size();
        if (i + 1 == repeats) {
            auto labelled = vccs.getLabeledCloud();
            for (std::size_t p = 0; p < cloud->size(); ++p) {
                labels[p] = (*labelled)[p].label;
            }
            lccp.relabelCloud(*labelled);
            for (std::size_t p = 0; p < cloud->size(); ++p) {
                labels[cloud->size() + p] = (*labelled)[p].label;
            }
        }
    }
    std::ofstream out(argv[2], std::ios::binary);
    out.write(reinterpret_cast<const char *>(labels.data()),
              static_cast<std::streamsize>(labels.size() * sizeof(std::uint32_t)));
    std::printf("{\"version\": \"%s\", \"cpu_ms\": %.3f, \"supervoxels_cpu_ms\": %.3f, \"supervoxels\": %zu}\n",
                PCL_VERSION_PRETTY, best_all * 1e3, best_supervoxels * 1e3, supervoxels_found);
    return out ? 0 : 1;
}
