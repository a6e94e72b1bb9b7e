// Prints a robot as Gazebo reads it, by its parser sdformat: "link NAME MASS X Y Z QW QX QY QZ" with the place of the link's
// frame at zero positions, and "joint NAME KIND" (sdf::JointType). Messages of errors go to standard error.
//
//     g++ -std=c++17 load.cpp -o load $(pkg-config --cflags --libs sdformat12) && ./load robot.urdf
#include <cstdio>
#include <type_traits>
#include <sdf/sdf.hh>

int main(int count, char **arguments)
{
    sdf::Root root;
    sdf::Errors errors = root.Load(count > 1 ? arguments[1] : "");
    const sdf::Model *model = root.Model();
    for (uint64_t k = 0; model && k < model->LinkCount(); ++k)
    {
        const sdf::Link &link = *model->LinkByIndex(k);
        std::decay_t<decltype(link.RawPose())> pose;
        for (const sdf::Error &error : link.SemanticPose().Resolve(pose, "__model__"))
            errors.push_back(error);
        std::printf("link %s %.17g %.17g %.17g %.17g %.17g %.17g %.17g %.17g\n", link.Name().c_str(),
                    link.Inertial().MassMatrix().Mass(), pose.X(), pose.Y(), pose.Z(), pose.Rot().W(), pose.Rot().X(),
                    pose.Rot().Y(), pose.Rot().Z());
    }
    for (uint64_t k = 0; model && k < model->JointCount(); ++k)
    {
        const sdf::Joint &joint = *model->JointByIndex(k);
        std::printf("joint %s %d\n", joint.Name().c_str(), static_cast<int>(joint.Type()));
    }
    for (const sdf::Error &error : errors)
        std::fprintf(stderr, "%s\n", error.Message().c_str());
    return model && errors.empty() ? 0 : 1;
}
