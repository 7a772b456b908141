// SPDX-License-Identifier: BSD-3-Clause
/**
 * The kernels of ResamplingKernel.h in double precision, by their own integrals.
 */
#pragma once

namespace SurfelSplatting
{
/// A kernel as a function of t = 1 - q/q0, 1 at t = 1; of the Gaussian, as one of q.
struct ReferenceKernel
{
  enum Types
  {
    Gaussian, ///< exp(-q/2)
    Bell,     ///< Edge t + P t^2 + (1 - Edge - P) t^4
    Smooth    ///< u^2 (3 - 2u), u = min(1, P t)
  };
  Types Type = Gaussian;
  double P = 0.0, Edge = 0.0;
  double Mass = 0.0;   ///< integral over t in [0, 1]; not of the Gaussian
  double Moment = 0.0; ///< that of the kernel times 1 - t

  /// Bell or Smooth.
  double At(double t) const;
  /// q0, for unit variance: the mean of q is 2.
  double Reach() const { return 2.0 * this->Mass / this->Moment; }
};

/// The kernel of splats in front of or behind the focus, and in focus (infinite exponent).
ReferenceKernel ChooseReferenceKernel(double pearsonExponent);

/**
 * Exponent of the Pearson-II kernel for W and a disc of radius C: both have the same Mardia's
 * kurtosis E[(x' W^-1 x)^2]; with little blur, the same kurtosis across the thin direction of W.
 * For the disc convolved with a Gaussian it is 8 plus the disc's fourth cumulant, -C^4/48 (d_ij
 * d_kl + d_ik d_jl + d_il d_jk), contracted with W^-1 W^-1. For Pearson II it is 8 - 8 / (n + 3).
 */
double ReferencePearsonExponent(const double w[2][2], double squaredConfusion);

/// The kernel of a blurred splat with this Pearson exponent, at q = x' W^-1 x, for unit mass and
/// det W = 1.
class ReferenceBlurKernel
{
public:
  explicit ReferenceBlurKernel(double exponent);
  double At(double q) const;

  double Reach; ///< q0: it is 0 from there on

private:
  ReferenceKernel Kernel;
};
}
