// SPDX-License-Identifier: BSD-3-Clause
#include "Filters/Cleaning/CleaningProblem.h"

#include <algorithm>

namespace SurfelGeometry
{
vtkIdType CleaningProblem::Total() const
{
  return this->Sharing ? this->Sharing->Total : this->Cloud().Size();
}

std::vector<int> CleaningProblem::Samples(double share) const
{
  std::vector<int> samples = SamplePoints(this->Cloud(), share);
  const auto isOfOthers = [this](int i) { return !this->IsOwn(i); };
  samples.erase(std::remove_if(samples.begin(), samples.end(), isOfOthers), samples.end());
  return samples;
}

Float3 CleaningProblem::SharedPosition(int i) const
{
  const LocalCloud& cloud = this->Cloud();
  Vector3 p = Load(cloud.Position(i));
  for (int c = 0; this->Sharing && c < 3; ++c)
  {
    p[c] += cloud.Origin[c] - this->Sharing->Origin[c];
  }
  return p;
}

void CleaningProblem::PutPosition(int i, std::vector<float>& values) const
{
  const Float3 p = this->SharedPosition(i);
  values.insert(values.end(), { p.X, p.Y, p.Z });
}

bool CleaningProblem::All(bool condition) const
{
  std::vector<float> none;
  return this->Gather(condition, none);
}

bool CleaningProblem::Gather(bool running, std::vector<float>& values) const
{
  return this->Sharing ? this->Sharing->Gather(running, values) : running;
}
}
