// The terms of a momentum observer with pinocchio's C++ headers, sample by sample, for robot_dynamics.py (ctypes).
// The model is built here, joint by joint, so that nothing compiled with other options is linked to.

#include <pinocchio/algorithm/crba.hpp>
#include <pinocchio/algorithm/rnea.hpp>
#include <pinocchio/multibody.hpp>

#include <cstdint>
#include <string>

using RowMatrix = Eigen::Matrix<double, 3, 3, Eigen::RowMajor>;
using Vector = Eigen::Map<Eigen::VectorXd>;
using ReadVector = Eigen::Map<const Eigen::VectorXd>;

// A chain of joints about z. A joint's numbers: placement (9 + 3), mass, centre of mass (3), inertia about it (9).
extern "C" void *build_chain(std::int64_t joints, const double *numbers)
{
  auto *model = new pinocchio::Model();
  for (std::int64_t i = 0; i < joints; ++i, numbers += 25)
  {
    const pinocchio::SE3 placement(Eigen::Map<const RowMatrix>(numbers), Eigen::Vector3d(numbers[9], numbers[10], numbers[11]));
    const pinocchio::Inertia body(numbers[12], Eigen::Vector3d(numbers[13], numbers[14], numbers[15]),
                                  Eigen::Matrix3d(Eigen::Map<const RowMatrix>(numbers + 16)));
    const auto joint = model->addJoint(i, pinocchio::JointModelRZ(), placement, "joint" + std::to_string(i));
    model->appendBodyToJoint(joint, body, pinocchio::SE3::Identity());
  }
  return model;
}

extern "C" void momentum_terms(const void *chain, std::int64_t samples, const double *position, const double *speed,
                               double *momentum, double *force, double *gravity)
{
  const auto &model = *static_cast<const pinocchio::Model *>(chain);
  pinocchio::Data data(model);
  const Eigen::Index joints = model.nv;
  for (std::int64_t k = 0; k < samples; ++k)
  {
    const ReadVector q(position + k * joints, joints), v(speed + k * joints, joints);
    pinocchio::crba(model, data, q, pinocchio::Convention::WORLD);
    Vector(momentum + k * joints, joints).noalias() = data.M.selfadjointView<Eigen::Upper>() * v;
    pinocchio::computeCoriolisMatrix(model, data, q, v);
    Vector(force + k * joints, joints).noalias() = data.C.transpose() * v;
    Vector(gravity + k * joints, joints) = pinocchio::computeGeneralizedGravity(model, data, q);
  }
}

