// The bounds of an object, without OpenGL.
#include <terrane/scene/culling.h>

#include <cstdio>

int main() {
    const terrane::Aabb box = {Eigen::Vector3d(-1, -1, 0), Eigen::Vector3d(1, 1, 8)};
    const terrane::BoundingSphere ball = terrane::bounding_sphere(terrane::transform({}, 2.0, box));
    std::printf("radius %.3f m\n", ball.radius);
    return ball.radius > 8.0 ? 0 : 1;
}
