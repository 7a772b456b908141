// SPDX-License-Identifier: BSD-3-Clause
/**
 * What the rendering tests share: VTK's messages, analytic surfels, windows and pictures.
 */
#pragma once

#include "Testing/Shared/Check.h"

#include <vtkNew.h>
#include <vtkSmartPointer.h>

#include <array>
#include <cstddef>
#include <functional>
#include <string>
#include <vector>

class vtkActor;
class vtkCamera;
class vtkImageData;
class vtkPolyData;
class vtkRenderWindow;
class vtkRenderer;
class vtkSurfelSplattingPass;

namespace RenderingTest
{
using SurfelTesting::Near;
using Vector = std::array<double, 3>;

/// Keeps VTK's errors and warnings during a test. Those that the test does not take make it fail.
class NoMessages
{
public:
  NoMessages();
  ~NoMessages();
};

/// The same for tests that mean to draw dots: without the warning of them.
class OnlyOfDots : public NoMessages
{
public:
  OnlyOfDots();
  ~OnlyOfDots();
};

/// VTK's errors and warnings since the last call, joined.
std::string TakeMessages();

/// Surfels made from formulas: kernels of half the spacing, area vectors of the whole area.
class SurfelBuilder
{
public:
  SurfelBuilder();
  ~SurfelBuilder();

  /// One surfel: covariance s^2 (I - nn'), area vector a n.
  void Add(const Vector& position, const Vector& normal, double s, double area);

  /// Fibonacci points on a sphere.
  void AddSphere(const Vector& center, double radius, int count);

  /// Points on a grid: corner + (i + 1/2) u + (j + 1/2) v, u and v at right angles, normal u x v.
  void AddGrid(const Vector& corner, const Vector& u, const Vector& v, int countU, int countV);

  /// Unsigned char RGB(A) scalars from the position of each surfel.
  void Color(const std::function<std::array<int, 4>(const Vector&)>& function, int components = 3);

  vtkSmartPointer<vtkPolyData> Data;
};

/// Sphere of unit radius about the origin, white.
vtkSmartPointer<vtkPolyData> UnitSphere(int count = 4000);

/// Unlit actor of surfels.
vtkSmartPointer<vtkActor> SurfelActor(vtkPolyData* surfels);

/// Unlit rectangle corner, corner + u, corner + u + v, corner + v as an ordinary mesh.
vtkSmartPointer<vtkActor> QuadActor(
  const Vector& corner, const Vector& u, const Vector& v, const Vector& color);

/// A camera at (0, 0, distance) that looks at the origin; f = height / 2 / tan(viewAngle / 2) px.
/// Without lens.
vtkSmartPointer<vtkCamera> FrontCamera(double distance, double viewAngle = 30.0);

/// A window off screen with one renderer, one headlight and, if wanted, the pass.
struct Scene
{
  explicit Scene(int width, int height, int multiSamples = 0, bool withPass = true);

  /// Sets the camera and fits its clipping range.
  void See(vtkCamera* camera);

  /// Renders and gives what is in the window.
  vtkSmartPointer<vtkImageData> Render();

  /// The pass's float picture.
  vtkImageData* Float();

  vtkSmartPointer<vtkRenderWindow> Window;
  vtkSmartPointer<vtkRenderer> Renderer;
  vtkSmartPointer<vtkSurfelSplattingPass> Pass;
};

/// RGB of the window as it is.
vtkSmartPointer<vtkImageData> Grab(vtkRenderWindow* window);

/// The window's picture at twice its size, of four tiles. Renders the window once before.
vtkSmartPointer<vtkImageData> RenderPoster(vtkRenderWindow* window);

/// A rectangle of surfels and the same rectangle as a mesh, seen by one eye; 120 x 90 px.
struct EyePictures
{
  /// @param eye VTK_STEREO_LEFT or VTK_STEREO_RIGHT; both are 6 degrees apart
  EyePictures(int eye, vtkCamera* camera, int cells = 1);

  vtkSmartPointer<vtkImageData> Splats, Polygons;
  vtkSmartPointer<vtkImageData> Mono; ///< of the mesh, by eyes in one place
};

/// Component c of the pixel, on the picture's own scale.
double At(vtkImageData* picture, int x, int y, int c);

/// Array values of a float picture ("Color", "Depth").
std::vector<float> Values(vtkImageData* picture, const char* array);

/// Difference of two pictures' scalars on their own scale; infinite where sizes differ.
struct Difference
{
  double Max = 0.0;
  double Mean = 0.0;
};
Difference Compare(vtkImageData* a, vtkImageData* b);

/// Number of pixels whose component c differs by more than a tolerance; INT_MAX if the pictures'
/// sizes differ.
int CountDifferent(vtkImageData* a, vtkImageData* b, int c, double tolerance);

/// Part of a picture.
vtkSmartPointer<vtkImageData> Crop(vtkImageData* picture, int x, int y, int width, int height);

/// Number of pixels whose components exceed a value somewhere.
int CountBrighter(vtkImageData* picture, double value);

/// Folder of the pictures to compare with, and whether they are to be rewritten (environment
/// variable SURFELSPLATTING_WRITE_BASELINES).
std::string BaselineFolder();
bool WriteBaselines();
}
