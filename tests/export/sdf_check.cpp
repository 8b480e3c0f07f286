// Loads an SDF file as Gazebo does and prints what libsdformat found: links, joints and all that is wrong.
#include <cstdio>
#include <sdf/sdf.hh>

static void print(const char *name, const ignition::math::Pose3d &p) {
  std::printf("\"%s\": [%.17g, %.17g, %.17g, %.17g, %.17g, %.17g, %.17g]", name, p.Pos().X(), p.Pos().Y(),
              p.Pos().Z(), p.Rot().X(), p.Rot().Y(), p.Rot().Z(), p.Rot().W());
}

int main(int, char **argv) {
  sdf::Root root;
  sdf::Errors errors = root.Load(argv[1]);
  const sdf::Model *model = root.Model();
  std::printf("{\"links\": {");
  for (uint64_t i = 0; model && i < model->LinkCount(); ++i) {
    const sdf::Link *link = model->LinkByIndex(i);
    ignition::math::Pose3d pose;
    for (const sdf::Error &error : link->SemanticPose().Resolve(pose, "__model__")) errors.push_back(error);
    const auto mass = link->Inertial().MassMatrix();
    const auto moment = link->Inertial().Moi();
    std::printf("%s\"%s\": {", i ? ", " : "", link->Name().c_str());
    print("pose", pose);
    std::printf(", ");
    print("inertial_pose", link->Inertial().Pose());
    std::printf(", \"mass\": %.17g, \"visuals\": %d, \"inertia\": [", mass.Mass(), (int)link->VisualCount());
    for (int k = 0; k < 9; ++k) std::printf("%s%.17g", k ? ", " : "", moment(k / 3, k % 3));
    std::printf("]}");
  }
  std::printf("}, \"joints\": {");
  for (uint64_t i = 0; model && i < model->JointCount(); ++i) {
    const sdf::Joint *joint = model->JointByIndex(i);
    ignition::math::Pose3d pose;
    for (const sdf::Error &error : joint->SemanticPose().Resolve(pose, "__model__")) errors.push_back(error);
    std::printf("%s\"%s\": {\"type\": %d, \"parent\": \"%s\", \"child\": \"%s\", ", i ? ", " : "",
                joint->Name().c_str(), (int)joint->Type(), joint->ParentLinkName().c_str(),
                joint->ChildLinkName().c_str());
    print("pose", pose);
    std::printf(", \"axes\": [");
    for (unsigned k = 0; k < 2 && joint->Axis(k); ++k) {
      ignition::math::Vector3d axis;
      for (const sdf::Error &error : joint->Axis(k)->ResolveXyz(axis, "__model__")) errors.push_back(error);
      std::printf("%s{\"xyz\": [%.17g, %.17g, %.17g], \"lower\": %.17g, \"upper\": %.17g, \"effort\": %.17g}",
                  k ? ", " : "", axis.X(), axis.Y(), axis.Z(), joint->Axis(k)->Lower(),
                  joint->Axis(k)->Upper(), joint->Axis(k)->Effort());
    }
    std::printf("]}");
  }
  std::printf("}, \"errors\": %d}\n", (int)errors.size());
  for (const sdf::Error &error : errors) std::fprintf(stderr, "%s\n", error.Message().c_str());
  return errors.empty() && model ? 0 : 1;
}
