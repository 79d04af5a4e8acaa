// Pinocchio's articulated-body algorithm, from the library of the wheel (-DSHIPPED) or compiled here from its headers.
// A row of ``setup`` is: parent, joint (0-2 revolute, 3-5 prismatic, along x, y, z), place, mass, centre, inertia (3 x 3).
#define BOOST_MPL_LIMIT_LIST_SIZE 30
#define BOOST_MPL_LIMIT_VECTOR_SIZE 30
#define BOOST_MPL_CFG_NO_PREPROCESSED_HEADERS
#define BOOST_FUSION_INVOKE_MAX_ARITY 12
#ifdef SHIPPED
#define PINOCCHIO_ENABLE_TEMPLATE_INSTANTIATION
#endif
#include <pinocchio/multibody.hpp>

#include <memory>
#include <pinocchio/algorithm/aba.hpp>

using namespace pinocchio;

namespace {

struct Arm {
    Model model;
    std::unique_ptr<Data> data;
    Eigen::VectorXd q, v, tau;
};

Arm &arm = *new Arm;  // never destroyed: libraries are unloaded in any order

JointModel joint(int kind) {
    switch (kind) {
        case 0: return JointModelRX();
        case 1: return JointModelRY();
        case 2: return JointModelRZ();
        case 3: return JointModelPX();
        default: return JointModelPY();
    }
}

}  // namespace

extern "C" void setup(int n, const double gravity[], const double rows[]) {
    arm.model.gravity.linear() << gravity[0], gravity[1], gravity[2];
    for (int i = 0; i < n; i++) {
        const double *r = rows + 18 * i;
        const SE3 place(Eigen::Matrix3d::Identity(), Eigen::Vector3d(r[2], r[3], r[4]));
        const auto parent = static_cast<JointIndex>(r[0] + 1);
        const JointIndex index = arm.model.addJoint(parent, joint(static_cast<int>(r[1])), place, std::to_string(i));
        const Eigen::Matrix3d inertia = Eigen::Map<const Eigen::Matrix3d>(r + 9);
        arm.model.appendBodyToJoint(index, Inertia(r[5], Eigen::Vector3d(r[6], r[7], r[8]), inertia), SE3::Identity());
    }
    arm.data = std::make_unique<Data>(arm.model);
    arm.q.resize(n);
    arm.v.resize(n);
    arm.tau.resize(n);
}

extern "C" void call(const double in[], double out[]) {
    const Eigen::Index n = arm.q.size();
    arm.q = Eigen::Map<const Eigen::VectorXd>(in, n);
    arm.v = Eigen::Map<const Eigen::VectorXd>(in + n, n);
    arm.tau = Eigen::Map<const Eigen::VectorXd>(in + 2 * n, n);
    aba(arm.model, *arm.data, arm.q, arm.v, arm.tau, Convention::LOCAL);
    Eigen::Map<Eigen::VectorXd>(out, n) = arm.data->ddq;
}
