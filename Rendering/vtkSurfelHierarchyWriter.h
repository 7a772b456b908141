// SPDX-License-Identifier: BSD-3-Clause
/**
 * @class   vtkSurfelHierarchyWriter
 * @brief   writes hierarchies of surfels as files that open by mapping
 *
 * This writer writes the output of vtkSurfelHierarchy, and what the first frame would compute of
 * it, for vtkSurfelHierarchyReader (.surfels, Documentation/DataContract.md). The file takes 48
 * bytes for the node of a surfel, 36 for its colours if the active scalars are colours of 8 bits, 4
 * for the bounds that select the cut, and the point arrays of the surfel. Point and field arrays of
 * numbers are kept; strings and cells are not, and a warning names what is left out. Gaussians in
 * space are refused.
 *
 * Surfels without a hierarchy become one in the file; AddPiece() takes clouds that are larger than
 * the memory. It writes the whole file or none. If the file name is a link, its target is written
 * and the link stays.
 *
 * @sa vtkSurfelHierarchyReader vtkSurfelHierarchy
 */
#ifndef vtkSurfelHierarchyWriter_h
#define vtkSurfelHierarchyWriter_h

#include "vtkPolyDataAlgorithm.h"
#include "vtkSurfelRenderingModule.h" // for export macro

#include <memory> // for members

namespace SurfelSplatting
{
class SurfelSpool;
}

class VTKSURFELRENDERING_EXPORT vtkSurfelHierarchyWriter : public vtkPolyDataAlgorithm
{
public:
  static vtkSurfelHierarchyWriter* New();
  vtkTypeMacro(vtkSurfelHierarchyWriter, vtkPolyDataAlgorithm);
  void PrintSelf(ostream& os, vtkIndent indent) override;

  ///@{
  /**
   * Path of the file. Default none.
   */
  vtkSetFilePathMacro(FileName);
  vtkGetFilePathMacro(FileName);
  ///@}

  /**
   * Adds surfels to a cloud that is too large for the memory: the next Write() makes one hierarchy
   * of all pieces since the last one, in the file itself, instead of writing the input. Until then
   * they are in files beside it, 54 bytes for each surfel with a colour. The file name must be set
   * before. Each piece needs the point arrays that the first one has; their origins (field array
   * SurfelOrigin) may differ. Returns whether it has succeeded; after an error all pieces are
   * dropped.
   */
  bool AddPiece(vtkPolyData* surfels);

  /**
   * Writes the pieces that were added. Without any, updates the input and writes it: a hierarchy,
   * or surfels, of which it makes one. That takes 40 bytes of memory for each surfel besides the
   * input. Returns 1, or 0 after an error; GetErrorCode() is then not 0.
   */
  int Write();

protected:
  vtkSurfelHierarchyWriter();
  ~vtkSurfelHierarchyWriter() override;

  int RequestData(vtkInformation* request, vtkInformationVector** inputVector,
    vtkInformationVector* outputVector) override;

private:
  vtkSurfelHierarchyWriter(const vtkSurfelHierarchyWriter&) = delete;
  void operator=(const vtkSurfelHierarchyWriter&) = delete;

  bool Begin(); ///< clears the error; false if there is no file name
  bool WriteFile(vtkPolyData* surfels);
  void WarnOfLeftOut(vtkPolyData* surfels);
  void ReportError(unsigned long code, const char* problem);

  char* FileName = nullptr;
  std::unique_ptr<SurfelSplatting::SurfelSpool> Pieces;
};

#endif
