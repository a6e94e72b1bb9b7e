// Pinocchio's side of tests/compare_pinocchio: checks that both programs compute the same, and times its own functions.
//   peer check FILE...   compares with the results in the files that `cargo bench --bench peer -- write` made
//   peer times FILE...   prints one line a function: arm, function, nanoseconds a sample
#include <pinocchio/multibody.hpp>
#include <pinocchio/algorithm/rnea.hpp>
#include <pinocchio/algorithm/crba.hpp>
#include <pinocchio/algorithm/aba.hpp>
#include <pinocchio/algorithm/aba-derivatives.hpp>
#include <pinocchio/algorithm/rnea-derivatives.hpp>
#include <pinocchio/algorithm/regressor.hpp>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <string>
#include <vector>

using Eigen::Matrix3d;
using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;
namespace pin = pinocchio;

constexpr int SAMPLES = 1000;
constexpr int RECORDING = 10000;

struct Check {
    VectorXd q, v, a, tau, forward;
    MatrixXd inertia, regressor;
    // Of torques by position and velocity; of accelerations by position, velocity and torque (lower triangle).
    MatrixXd derivatives[5];
};

struct Arm {
    std::string name;
    int n;
    pin::Model model;
    std::vector<Check> checks;
};

[[noreturn]] void fail(const std::string &text) {
    std::fprintf(stderr, "peer: %s\n", text.c_str());
    std::exit(1);
}

Arm read(const std::string &path) {
    std::ifstream in(path);
    Arm arm;
    int checks = 0;
    if (!(in >> arm.name >> arm.n >> checks)) fail(path + " cannot be read");
    auto number = [&] {
        double x;
        if (!(in >> x)) fail(path + " ends early");
        return x;
    };
    auto vector = [&](int size) {
        VectorXd v(size);
        for (int i = 0; i < size; i++) v[i] = number();
        return v;
    };
    auto matrix = [&](int rows, int columns) {
        MatrixXd m(rows, columns);
        for (int i = 0; i < rows; i++)
            for (int j = 0; j < columns; j++) m(i, j) = number();
        return m;
    };
    arm.model.gravity.linear() = vector(3);
    pin::JointIndex parent = 0;
    for (int i = 0; i < arm.n; i++) {
        const double alpha = number(), a = number(), theta = number(), d = number();
        const pin::SE3 place =
            pin::SE3(Eigen::AngleAxisd(alpha, Vector3d::UnitX()).toRotationMatrix(), Vector3d::Zero())
            * pin::SE3(Matrix3d::Identity(), Vector3d(a, 0, 0))
            * pin::SE3(Eigen::AngleAxisd(theta, Vector3d::UnitZ()).toRotationMatrix(), Vector3d(0, 0, d));
        const VectorXd p = vector(10);
        const Vector3d c = p.segment<3>(1) / p[0];
        Matrix3d about_origin;
        about_origin << p[4], p[5], p[6], p[5], p[7], p[8], p[6], p[8], p[9];
        const Matrix3d about_centre = about_origin + p[0] * pin::skew(c) * pin::skew(c);
        parent = arm.model.addJoint(parent, pin::JointModelRZ(), place, "joint" + std::to_string(i + 1));
        arm.model.appendBodyToJoint(parent, pin::Inertia(p[0], c, about_centre), pin::SE3::Identity());
    }
    for (int k = 0; k < checks; k++) {
        Check check;
        check.q = vector(arm.n);
        check.v = vector(arm.n);
        check.a = vector(arm.n);
        check.tau = vector(arm.n);
        check.inertia = MatrixXd::Zero(arm.n, arm.n);
        for (int i = 0; i < arm.n; i++)
            for (int j = 0; j <= i; j++) check.inertia(i, j) = number();
        check.forward = vector(arm.n);
        for (int part = 0; part < 4; part++) check.derivatives[part] = matrix(arm.n, arm.n);
        check.derivatives[4] = MatrixXd::Zero(arm.n, arm.n);
        for (int i = 0; i < arm.n; i++)
            for (int j = 0; j <= i; j++) check.derivatives[4](i, j) = number();
        check.regressor = matrix(arm.n, 10 * arm.n);
        arm.checks.push_back(check);
    }
    return arm;
}

// Largest difference over the larger of 1 and the largest entry.
double difference(const MatrixXd &ours, const MatrixXd &theirs) {
    const double scale = std::max({1.0, ours.cwiseAbs().maxCoeff(), theirs.cwiseAbs().maxCoeff()});
    return (ours - theirs).cwiseAbs().maxCoeff() / scale;
}

void check(Arm &arm) {
    pin::Data data(arm.model);
    double tau = 0, inertia = 0, forward = 0, regressor = 0, inverse_derivatives = 0, forward_derivatives = 0;
    for (const Check &c : arm.checks) {
        tau = std::max(tau, difference(c.tau, pin::rnea(arm.model, data, c.q, c.v, c.a)));
        // It fills the upper triangle, the other side the lower.
        MatrixXd m = MatrixXd::Zero(arm.n, arm.n);
        m.triangularView<Eigen::Lower>() = pin::crba(arm.model, data, c.q).transpose();
        inertia = std::max(inertia, difference(c.inertia, m));
        forward = std::max(forward, difference(c.forward, pin::aba(arm.model, data, c.q, c.v, c.tau)));
        pin::computeRNEADerivatives(arm.model, data, c.q, c.v, c.a);
        inverse_derivatives = std::max({inverse_derivatives, difference(c.derivatives[0], data.dtau_dq),
                                        difference(c.derivatives[1], data.dtau_dv)});
        pin::computeABADerivatives(arm.model, data, c.q, c.v, c.tau);
        MatrixXd inverse = MatrixXd::Zero(arm.n, arm.n);
        inverse.triangularView<Eigen::Lower>() = data.Minv.transpose();
        forward_derivatives = std::max({forward_derivatives, difference(c.derivatives[2], data.ddq_dq),
                                        difference(c.derivatives[3], data.ddq_dv), difference(c.derivatives[4], inverse)});
        // Its order of a link's parameters: m, mc, Ixx, Ixy, Iyy, Ixz, Iyz, Izz.
        const MatrixXd y = pin::computeJointTorqueRegressor(arm.model, data, c.q, c.v, c.a);
        MatrixXd sorted = y;
        const int order[10] = {0, 1, 2, 3, 4, 5, 7, 6, 8, 9};
        for (int i = 0; i < arm.n; i++)
            for (int k = 0; k < 10; k++) sorted.col(10 * i + k) = y.col(10 * i + order[k]);
        regressor = std::max(regressor, difference(c.regressor, sorted));
    }
    std::printf("%s: largest relative differences over %zu motions: inverse dynamics %.1e, inertia matrix %.1e, "
                "forward dynamics %.1e, regressor %.1e, derivatives of inverse dynamics %.1e, of forward dynamics %.1e\n",
                arm.name.c_str(), arm.checks.size(), tau, inertia, forward, regressor, inverse_derivatives,
                forward_derivatives);
    // Forward dynamics carries the rounding times the condition of the inertia matrix.
    if (!(tau < 1e-11 && inertia < 1e-11 && forward < 1e-8 && regressor < 1e-11 && inverse_derivatives < 1e-11
          && forward_derivatives < 1e-8))
        fail(arm.name + ": the two programs do not agree");
}

template <class F> void time(const Arm &arm, const char *function, int samples, F &&walk) {
    using clock = std::chrono::steady_clock;
    const auto begin = clock::now();
    double least = INFINITY;
    for (int calls = 0; calls < 5 || clock::now() - begin < std::chrono::milliseconds(250); calls++) {
        const auto start = clock::now();
        walk();
        least = std::min(least, std::chrono::duration<double, std::nano>(clock::now() - start).count() / samples);
    }
    std::printf("%s %s %.1f\n", arm.name.c_str(), function, least);
}

struct Motion {
    std::vector<VectorXd> q, v, a;
};

// The motion of host/model/benches/arms/mod.rs.
Motion motion(int n, int samples) {
    Motion m;
    for (int k = 0; k < samples; k++) {
        VectorXd q = VectorXd::Zero(n), v = q, a = q;
        for (int j = 0; j < n; j++)
            for (int h = 0; h < 3; h++) {
                const double amplitude = (const double[]){1.2, 0.5, 0.2}[h];
                const double w = 0.9 + 0.37 * j + 2.3 * h, x = w * k * 0.01 + j * h;
                q[j] += amplitude * std::sin(x);
                v[j] += amplitude * w * std::cos(x);
                a[j] -= amplitude * w * w * std::sin(x);
            }
        m.q.push_back(q);
        m.v.push_back(v);
        m.a.push_back(a);
    }
    return m;
}

void times(Arm &arm) {
    pin::Data data(arm.model);
    const Motion m = motion(arm.n, SAMPLES);
    double sink = 0;
    time(arm, "inverse_dynamics", SAMPLES, [&] {
        for (int k = 0; k < SAMPLES; k++) sink += pin::rnea(arm.model, data, m.q[k], m.v[k], m.a[k])[0];
    });
    time(arm, "inertia_matrix", SAMPLES, [&] {
        for (int k = 0; k < SAMPLES; k++) sink += pin::crba(arm.model, data, m.q[k])(0, 0);
    });
    time(arm, "forward_dynamics", SAMPLES, [&] {
        for (int k = 0; k < SAMPLES; k++) sink += pin::aba(arm.model, data, m.q[k], m.v[k], m.a[k])[0];
    });
    time(arm, "inverse_dynamics_derivatives", SAMPLES, [&] {
        for (int k = 0; k < SAMPLES; k++) {
            pin::computeRNEADerivatives(arm.model, data, m.q[k], m.v[k], m.a[k]);
            sink += data.dtau_dq(0, 0);
        }
    });
    time(arm, "forward_dynamics_derivatives", SAMPLES, [&] {
        for (int k = 0; k < SAMPLES; k++) {
            pin::computeABADerivatives(arm.model, data, m.q[k], m.v[k], m.a[k]);
            sink += data.ddq_dq(0, 0);
        }
    });
    time(arm, "regressor", SAMPLES, [&] {
        for (int k = 0; k < SAMPLES; k++)
            sink += pin::computeJointTorqueRegressor(arm.model, data, m.q[k], m.v[k], m.a[k])(0, 0);
    });
    time(arm, "energy_regressor", SAMPLES, [&] {
        for (int k = 0; k < SAMPLES; k++) {
            sink += pin::computeKineticEnergyRegressor(arm.model, data, m.q[k], m.v[k])[0];
            sink += pin::computePotentialEnergyRegressor(arm.model, data, m.q[k])[0];
        }
    });
    const Motion r = motion(arm.n, RECORDING);
    // Row-major, so that a sample's rows are written in one piece.
    Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor> stacked(arm.n * RECORDING, 10 * arm.n);
    time(arm, "regressor_stored", RECORDING, [&] {
        for (int k = 0; k < RECORDING; k++)
            stacked.middleRows(arm.n * k, arm.n) =
                pin::computeJointTorqueRegressor(arm.model, data, r.q[k], r.v[k], r.a[k]);
    });
    // Read, so that no call can be left out.
    if (!std::isfinite(sink + stacked(arm.n, 0))) fail("a result is not a number");
}

int main(int count, char **arguments) {
    if (count < 3) fail("expected 'check FILE...' or 'times FILE...'");
    const std::string what = arguments[1];
    for (int i = 2; i < count; i++) {
        Arm arm = read(arguments[i]);
        if (what == "check") check(arm);
        else if (what == "times") times(arm);
        else fail("expected 'check' or 'times', found '" + what + "'");
    }
}
