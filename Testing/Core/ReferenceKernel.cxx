// SPDX-License-Identifier: BSD-3-Clause
#include "ReferenceKernel.h"

#include <algorithm>
#include <cmath>

namespace SurfelSplatting
{
namespace
{
constexpr double Pi = 3.14159265358979324;

/// Integrals of a smooth kernel of steepness s and of its products with 1 - t and (1 - t)^2 over t
/// in [0, 1]: a step on [0, e], and 1 on [e, 1]; if s < 1, the step's first part only.
void SmoothMoments(double s, double (&m)[3])
{
  const double e = std::min(1.0, 1.0 / s), u = std::min(1.0, s);
  double t[3]; // integrals of k t^j
  double power = e;
  for (int j = 0; j < 3; ++j, power *= e)
  {
    const double step = power * u * u * (3.0 / (j + 3) - 2.0 * u / (j + 4));
    t[j] = step + (1.0 - power) / (j + 1);
  }
  m[0] = t[0];
  m[1] = t[0] - t[1];
  m[2] = t[0] - 2.0 * t[1] + t[2];
}

/// The steepness with this E[q^2], if E[q] = 2: by bisection, since a steeper step has less.
double SmoothSteepness(double kurtosis)
{
  double low = 1e-6, high = 2e3; // the widest plateau that SmoothProfile makes
  for (int i = 0; i < 100; ++i)
  {
    const double s = std::sqrt(low * high);
    double m[3];
    SmoothMoments(s, m);
    (4.0 * m[0] * m[2] / (m[1] * m[1]) > kurtosis ? low : high) = s;
  }
  return low;
}
}

double ReferenceKernel::At(double t) const
{
  const double u = std::min(1.0, this->P * t);
  return this->Type == Smooth
    ? u * u * (3.0 - 2.0 * u)
    : this->Edge * t + this->P * t * t + (1.0 - this->Edge - this->P) * std::pow(t, 4.0);
}

double ReferencePearsonExponent(const double w[2][2], double squaredConfusion)
{
  const double det = w[0][0] * w[1][1] - w[0][1] * w[1][0];
  const double inverse[2][2] = { { w[1][1] / det, -w[0][1] / det },
    { -w[1][0] / det, w[0][0] / det } };
  double excess = 0.0;
  for (int index = 0; index < 16; ++index)
  {
    const int i = index & 1, j = index >> 1 & 1, k = index >> 2 & 1, l = index >> 3 & 1;
    const int deltas = (i == j && k == l) + (i == k && j == l) + (i == l && j == k);
    excess -= squaredConfusion * squaredConfusion / 48.0 * deltas * inverse[i][j] * inverse[k][l];
  }
  if (!(excess < 0.0))
  {
    return 1e300;
  }
  const double mean = -excess / 8.0;
  const double share = std::min(1.0, std::max(0.0, (50.0 - squaredConfusion) / 30.0));
  if (share == 0.0)
  {
    return 1.0 / mean - 3.0;
  }
  // Across the thin direction a disc's marginal, of kurtosis 2, is convolved with a Gaussian.
  double thinnest = 1e300;
  constexpr int Angles = 20000;
  for (int i = 0; i < Angles; ++i)
  {
    const double c = std::cos(Pi * i / Angles), d = std::sin(Pi * i / Angles);
    thinnest = std::min(thinnest, c * c * w[0][0] + 2.0 * c * d * w[0][1] + d * d * w[1][1]);
  }
  const double ofLens = 0.25 * squaredConfusion / thinnest;
  const double across = ofLens * ofLens / 3.0;
  return 1.0 / (mean + share * (across - mean)) - 3.0;
}

ReferenceKernel ChooseReferenceKernel(double n)
{
  ReferenceKernel kernel;
  if (n < 1.99)
  {
    kernel.Type = ReferenceKernel::Smooth;
    kernel.P = SmoothSteepness(8.0 - 8.0 / (std::max(n, 0.0) + 3.0));
    double m[3];
    SmoothMoments(kernel.P, m);
    kernel.Mass = m[0];
    kernel.Moment = m[1];
    return kernel;
  }
  kernel.Type = ReferenceKernel::Bell;
  // From the square to an edge of 0.34, and to 0.4 in focus.
  const double lack = 1.0 / (n + 3.0);
  const double wide = std::min(1.0, std::max(0.0, (1.0 / 4.99 - lack) / (1.0 / 4.99 - 0.07)));
  const double sharp = std::max(0.0, 1.0 - lack / 0.0025);
  kernel.P = 1.0 - wide;
  kernel.Edge = 0.34 * wide + 0.06 * sharp;
  constexpr int Steps = 2000; // Simpson's rule: 1e-13 for a polynomial of fifth degree
  for (int i = 0; i <= Steps; ++i)
  {
    const double t = static_cast<double>(i) / Steps;
    const double weight = (i == 0 || i == Steps ? 1.0 : i % 2 ? 4.0 : 2.0) / (3.0 * Steps);
    kernel.Mass += weight * kernel.At(t);
    kernel.Moment += weight * kernel.At(t) * (1.0 - t);
  }
  return kernel;
}

ReferenceBlurKernel::ReferenceBlurKernel(double exponent)
  : Kernel(ChooseReferenceKernel(exponent))
{
  this->Reach = this->Kernel.Reach();
}

double ReferenceBlurKernel::At(double q) const
{
  const double t = std::max(0.0, 1.0 - q / this->Reach);
  return this->Kernel.At(t) / (Pi * this->Reach * this->Kernel.Mass);
}
}
