// SPDX-License-Identifier: BSD-3-Clause
/**
 * The window in whose OpenGL context the objects of a class are. Internal to the module.
 */
#pragma once

#include <vtkOpenGLRenderWindow.h>
#include <vtkSmartPointer.h>
#include <vtkWeakPointer.h>

namespace SurfelSplatting
{
/// VTK deletes framebuffers and buffers in the current context. That of another window may have
/// objects of the same names, which would be deleted instead.
class OwningWindow
{
public:
  /// Call before objects are used in a window.
  /// @param release of (window): is called in the context of the window before, if it is another
  template <typename Release>
  void ChangeTo(vtkOpenGLRenderWindow* window, const Release& release)
  {
    const vtkSmartPointer<vtkOpenGLRenderWindow> before = this->Window.Get();
    if (before && before != window)
    {
      before->PushContext();
      release(before.Get());
      before->PopContext();
    }
    this->Window = window;
  }

private:
  vtkWeakPointer<vtkOpenGLRenderWindow> Window;
};
}
